//! Numbers by the properties of a BSDF: derivatives, velocities and gradients.
//!
//! A BSDF says which of its properties it is differentiated by ([`Bsdf::differentiated`](super::Bsdf::differentiated)); only these have
//! an entry, in the order of [`Property`].

use drt_math::Rgb;

use crate::model::surface::property::Property;

/// A set of properties.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PropertySet(u32);

impl PropertySet {
    /// The set without any.
    pub const NONE: Self = Self(0);

    /// The set of all.
    pub(super) const ALL: Self = Self::new(&Property::ALL);

    /// The set of those in a list.
    #[inline]
    #[must_use]
    pub const fn new(properties: &[Property]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < properties.len() {
            bits |= 1 << properties[i] as u32;
            i += 1;
        }
        Self(bits)
    }

    /// How many there are.
    #[inline]
    #[must_use]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// True when there are none.
    #[inline]
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True when a property is in the set.
    #[inline]
    #[must_use]
    pub const fn contains(self, property: Property) -> bool {
        self.0 & (1 << property as u32) != 0
    }

    /// The properties that are in either set.
    #[inline]
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The set without those of another one.
    #[inline]
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// How many in the set are before a property: its place among them.
    #[inline]
    pub(super) const fn rank(self, property: Property) -> usize {
        (self.0 & ((1 << property as u32) - 1)).count_ones() as usize
    }

    /// The properties, in their order.
    pub fn iter(self) -> impl Iterator<Item = Property> {
        let mut left = self.0;
        core::iter::from_fn(move || {
            let next = Property::ALL.get(left.trailing_zeros() as usize).copied();
            left &= left.wrapping_sub(1);
            next
        })
    }
}

/// One number per channel for some properties of a BSDF.
///
/// As part of a [`BsdfGradient`](super::BsdfGradient) it holds the derivative of each channel of the
/// value with respect to the same channel of the property, or to the property itself when that is a
/// scalar. A property without an entry counts as one whose entry is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfParams {
    properties: PropertySet,
    /// Entries in the order of the properties; zeros follow.
    values: [Rgb; Self::MOST],
}

/// A velocity of a BSDF's properties (a scalar's in every channel alike), or the gradient of a
/// number with respect to them (a scalar's is then the sum over its three channels).
pub type BsdfTangent = BsdfParams;

impl BsdfParams {
    /// Most properties that a BSDF is differentiated by: those of a principled one, of a coating over it, and of a mask around both.
    pub(super) const MOST: usize = 10;

    /// Entries of a set of properties, each by its place among them.
    #[inline]
    pub(super) fn from_ranks(properties: PropertySet, value: impl Fn(usize) -> Rgb) -> Self {
        let mut values = [Rgb::ZERO; Self::MOST];
        for (k, entry) in values.iter_mut().enumerate().take(properties.len()) {
            *entry = value(k);
        }
        Self { properties, values }
    }

    /// Entries of zero.
    #[inline]
    pub(crate) fn zeros(properties: PropertySet) -> Self {
        Self { properties, ..Self::default() }
    }

    /// The entry of a single property.
    #[inline]
    #[must_use]
    pub fn of(property: Property, value: Rgb) -> Self {
        Self::from_ranks(PropertySet::new(&[property]), |_| value)
    }

    /// The properties that have an entry.
    #[inline]
    #[must_use]
    pub fn properties(&self) -> PropertySet {
        self.properties
    }

    /// True when every entry is zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.values.iter().all(|v| v.is_zero())
    }

    /// The entry of a property; zero without one.
    #[inline]
    #[must_use]
    pub fn get(&self, property: Property) -> Rgb {
        if !self.properties.contains(property) {
            return Rgb::ZERO;
        }
        self.values.get(self.properties.rank(property)).copied().unwrap_or(Rgb::ZERO)
    }

    /// The entry of a property, to change it; without one it gets one of zero. `None` where no BSDF could have so many.
    #[inline]
    pub fn get_mut(&mut self, property: Property) -> Option<&mut Rgb> {
        let rank = self.properties.rank(property);
        if !self.properties.contains(property) {
            let count = self.properties.len();
            if count >= Self::MOST {
                return None;
            }
            self.values[rank..=count].rotate_right(1);
            self.properties = self.properties.union(PropertySet::new(&[property]));
        }
        self.values.get_mut(rank)
    }

    /// Sets the entry of a property.
    #[inline]
    pub(crate) fn set(&mut self, property: Property, value: Rgb) {
        if let Some(entry) = self.get_mut(property) {
            *entry = value;
        }
    }

    /// Adds to the entry of a property.
    #[inline]
    pub(crate) fn add(&mut self, property: Property, value: Rgb) {
        if let Some(entry) = self.get_mut(property) {
            *entry += value;
        }
    }

    /// Adds all entries of another.
    pub(crate) fn add_all(&mut self, other: &Self) {
        other.properties.iter().for_each(|p| self.add(p, other.get(p)));
    }

    /// All entries times a weight.
    #[inline]
    pub(crate) fn scaled(&self, weight: Rgb) -> Self {
        let mut scaled = *self;
        let count = self.properties.len();
        scaled.values.iter_mut().take(count).for_each(|v| *v *= weight);
        scaled
    }

    /// Rate of change of the value along a velocity of the properties.
    #[inline]
    #[must_use]
    pub fn dot(&self, velocity: &BsdfTangent) -> Rgb {
        if self.properties == velocity.properties {
            let pairs = self.values.iter().zip(&velocity.values).take(self.properties.len());
            return pairs.fold(Rgb::ZERO, |sum, (a, b)| sum + *a * *b);
        }
        velocity.properties.iter().fold(Rgb::ZERO, |sum, p| sum + self.get(p) * velocity.get(p))
    }

    /// Adds `weight` times the derivatives `params`: the transpose of [`BsdfParams::dot`], so that
    /// `weight · params.dot(v)` is what a gradient collected from zero gives along `v`.
    #[inline]
    pub fn scatter(&mut self, params: &BsdfParams, weight: Rgb) {
        if self.properties == params.properties {
            let count = self.properties.len();
            for (sum, value) in self.values.iter_mut().zip(&params.values).take(count) {
                *sum += *value * weight;
            }
        } else {
            params.properties.iter().for_each(|p| self.add(p, params.get(p) * weight));
        }
    }
}
