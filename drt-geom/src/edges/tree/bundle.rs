//! What eight segments amount to from a viewpoint.
//!
//! Among segments it is enough to choose by estimates that are nearly right, where only segments of
//! which nothing counts are left out for certain. So horizon and cone are planes widened by what
//! single precision rounds, and the point on the chosen one is drawn from the [part](super::piece) of it
//! that really counts.

use crate::edges::tree::eight::{Eight, Vectors, along, dot, each, pairs, same, vectors};
use crate::edges::tree::node::{LEAST_WEIGHT, range};
use crate::edges::tree::piece::Piece;
use crate::edges::tree::seen::{ALMOST_NOTHING, Lies, Local, Place, Seen, Toward, weights};

/// Up to eight segments.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    place: Place,
    a: Vectors,
    tangent: Vectors,
    length: Eight,
    faces: [Vectors; 2],
    /// As parts of the `unit`; those of open edges are the same in all.
    discontinuity: Eight,
    crease: [Eight; 2],
    /// In this the weights count.
    pub(super) unit: f64,
    /// Its first piece.
    pub(super) first: u32,
}

/// What ways of looking ask of a bundle's segments from a viewpoint.
pub(super) struct Lines {
    local: Local,
    /// From the viewpoint to the segments' first ends.
    to: Vectors,
    /// The parts of the segments above the horizon.
    parts: [Eight; 2],
    prior: Eight,
}

/// Of segments this much shorter than they are far away, the middle says enough.
const SHORT: f32 = 0.5;

impl Bundle {
    pub(super) fn new(pieces: &[Piece], first: usize) -> Self {
        let list = pieces.iter();
        let [low, high] = range(list.clone().flat_map(|p| p.line.ends()));
        let place = Place::new(low, high);
        let priors = |p: &Piece| {
            let [front, back] = if p.open { [p.discontinuity; 2] } else { p.crease };
            [p.discontinuity, front, back]
        };
        let largest = list.clone().flat_map(priors).fold(0.0, f64::max);
        let part = |prior: f64| if prior > 0.0 { (prior / largest).max(LEAST_WEIGHT) } else { 0.0 };
        let prior = |k: usize| Eight::gather(list.clone().map(|p| part(priors(p)[k])));
        Self {
            place,
            a: vectors(list.clone().map(|p| place.of(p.line.a))),
            tangent: vectors(list.clone().map(|p| p.line.tangent)),
            length: Eight::gather(list.clone().map(|p| p.line.length * place.scale)),
            faces: [0, 1].map(|k| vectors(list.clone().map(|p| p.faces[k]))),
            discontinuity: prior(0),
            crease: [prior(1), prior(2)],
            unit: largest * place.scale,
            first: first as u32,
        }
    }

    /// What the segments amount to, in multiples of the unit; 0 only where nothing counts.
    #[inline(always)]
    pub(super) fn weigh(&self, seen: &Seen) -> (Eight, Lines) {
        let local = seen.local(&self.place);
        let to = pairs(self.a, local.x(), |a, b| a - b);
        let prior = self.prior(to, &local);
        let parts = match seen.normal {
            Some((n, false)) => self.above(to, n, &local),
            _ => [Eight::ZERO, self.length],
        };
        let lines = Lines { local, to, parts, prior };
        (self.amount(seen, &lines, parts), lines)
    }

    /// What of these weights counts one way.
    #[inline(always)]
    pub(super) fn toward(&self, way: &Toward, seen: &Seen, weight: Eight, lines: &Lines) -> Eight {
        match way.lies(&lines.local, &self.place) {
            Lies::Outside => return Eight::ZERO,
            Lies::Inside => return weight,
            Lies::Across => {}
        }
        if !Eight::ZERO.any_less(weight) {
            return weight;
        }
        let (parts, cut) = way.clip(&lines.local, lines.to, self.tangent, lines.parts);
        let weight = if cut { self.amount(seen, lines, parts) } else { weight };
        // The nearest point of each part.
        let start = dot(lines.to, self.tangent);
        let nearest = (Eight::ZERO - start).max(parts[0]).min(parts[1]);
        let nearest = along(lines.to, self.tangent, nearest);
        let reach2 = way.reach2(&lines.local, &self.place);
        reach2.less(dot(nearest, nearest), Eight::ZERO, weight)
    }

    /// Light the segments may let through or hide: all that they may where rounding leaves it open on
    /// which sides of the faces the viewpoint is.
    #[inline(always)]
    fn prior(&self, to: Vectors, local: &Local) -> Eight {
        let tolerance = Eight::splat(local.tolerance);
        let [side0, side1] = [dot(self.faces[0], to), dot(self.faces[1], to)];
        let front0 = side0.less(tolerance, Eight::ONE, Eight::ZERO);
        let front1 = side1.less(tolerance, Eight::ONE, Eight::ZERO);
        let back0 = (Eight::ZERO - tolerance).less(side0, Eight::ONE, Eight::ZERO);
        let back1 = (Eight::ZERO - tolerance).less(side1, Eight::ONE, Eight::ZERO);
        self.discontinuity * (front0 * back1).max(back0 * front1)
            + self.crease[0] * (front0 * front1)
            + self.crease[1] * (back0 * back1)
    }

    /// The parts above the horizon.
    #[inline(always)]
    fn above(&self, to: Vectors, n: [f32; 3], local: &Local) -> [Eight; 2] {
        let first = dot(to, same(n)) + local.tolerance;
        let slope = dot(self.tangent, same(n));
        let second = first + self.length * slope;
        let zero = ((Eight::ZERO - first) / slope).max(Eight::ZERO).min(self.length);
        [
            Eight::ZERO.less(first, Eight::ZERO, zero),
            Eight::ZERO.less(second, self.length, Eight::ZERO.less(first, zero, Eight::ZERO)),
        ]
    }

    /// What parts amount to: integrals of kernel and scattering, the latter taken at some points.
    #[inline(always)]
    fn amount(&self, seen: &Seen, lines: &Lines, [from, until]: [Eight; 2]) -> Eight {
        let counts = from.less(until, lines.prior, Eight::ZERO);
        if !Eight::ZERO.any_less(counts) {
            return Eight::ZERO;
        }
        let start = dot(lines.to, self.tangent);
        let foot = along(lines.to, self.tangent, Eight::ZERO - start);
        let (near, far) = (start + from, start + until);
        let [a, b] = [near.abs(), far.abs()];
        let d = dot(foot, foot).sqrt().max(a.max(b) * 1e-6).max(Eight::splat(1e-18));
        let d2 = d * d;
        let [r0, r1] = [(d2 + near * near).sqrt(), (d2 + far * far).sqrt()];
        let length = until - from;
        // The integral of the kernel d / r^3 without differences of like numbers.
        let across = (far / r1 - near / r0) / d;
        let aside = d * length * (a + b) / ((b * r0 + a * r1) * r0 * r1);
        let mass = (near * far).less(Eight::ZERO, across, aside);
        let middle = (near + far) * 0.5;
        let mut mean = self.even(seen, foot, middle);
        let short = (d2 + middle * middle).sqrt() * SHORT;
        let long = short.any_less(length);
        let halfway = || {
            let sines = (near / r0 + far / r1) * 0.5;
            (d * sines / ((Eight::ONE - sines) * (sines + 1.0)).sqrt()).max(near).min(far)
        };
        if long {
            // One by one, as four copies of the same in a row take longer to fetch than to run.
            let mut all = Eight::ZERO;
            for (t, part) in [(near, 0.25), (far, 0.25), (halfway(), 0.5)] {
                all = all + self.even(seen, foot, t) * part;
            }
            mean = short.less(length, all, mean);
        }
        if seen.is_glossy() {
            let [first, last] = [self.direction(foot, near), self.direction(foot, far)];
            let mut lobes = seen.glossy(first, last);
            if long {
                let between = self.direction(foot, halfway());
                let parts = seen.glossy(first, between) + seen.glossy(between, last);
                lobes = short.less(length, parts * 0.5, lobes);
            }
            mean = mean + lobes;
        }
        weights(counts, counts * mass * mean)
    }

    /// The directions of the points `t` along the segments' lines from their feet.
    #[inline(always)]
    fn direction(&self, foot: Vectors, t: Eight) -> Vectors {
        let to = along(foot, self.tangent, t);
        let r = dot(to, to).sqrt();
        each(to, |c| c / r)
    }

    /// What is scattered from there, apart from lobes.
    #[inline(always)]
    fn even(&self, seen: &Seen, foot: Vectors, t: Eight) -> Eight {
        let Some((n, _)) = seen.normal else { return Eight::splat(seen.even) };
        let to = along(foot, self.tangent, t);
        let cosine = dot(to, same(n)).abs() / dot(to, to).sqrt();
        cosine.max(Eight::splat(ALMOST_NOTHING)) * seen.even
    }
}
