//! Typed access to what is inside an element. Whatever nobody asked for is an error in the end, so
//! that nothing in a scene file is silently ignored.

use std::cell::RefCell;
use std::path::PathBuf;

use drt_estimators::texture::Texture;
use drt_math::{Affine, Rgb, Vec3, vec3};

use super::element::Element;
use super::numbers::{number, plain_numbers, plain_value, triple};
use super::transform;
use crate::CliError;
use crate::files::input_file;

/// Properties of version 0.5 and 0.6 that do not change the expected image, by the element that they are in: they are about how an
/// image is computed, or how it is stored.
const HARMLESS: [(&str, &[&str]); 6] = [
    ("bsdf", &["specular_sampling_weight"]),
    ("film", &["burn", "exposure", "gamma", "key", "tonemap_method"]),
    (
        "integrator",
        &[
            "bidirectional",
            "bidirectional_mutation",
            "caustic_perturbation",
            "chain_length",
            "direct_samples",
            "lambda",
            "lens_perturbation",
            "light_image",
            "luminance_samples",
            "manifold_perturbation",
            "max_chains",
            "multi_chain_perturbation",
            "num_chains",
            "p_large",
            "sample_direct",
            "two_stage",
        ],
    ),
    ("medium", &["step_size"]),
    ("shape", &["collapse"]),
    ("texture", &["cache", "max_anisotropy"]),
];

/// Textures of these types vary; all others are one colour.
const VARYING: [&str; 4] = ["bitmap", "checkerboard", "mesh_attribute", "volume"];

/// The children of an element, each to be asked for once.
pub(super) struct Properties<'a> {
    /// The element itself.
    pub(super) element: &'a Element,
    used: RefCell<Vec<bool>>,
    /// Property names asked for, for the message about those that were not.
    asked: RefCell<Vec<&'static str>>,
    /// Textures that vary, by the property they stand for; whoever can use them takes them.
    textures: RefCell<Vec<(&'static str, Texture)>>,
}

impl<'a> Properties<'a> {
    /// Opens a plugin element: one with a `type`, perhaps a `name` and an `id`.
    pub(super) fn of(element: &'a Element) -> Result<Self, CliError> {
        element.only_attributes(&["type", "name", "id"])?;
        let mut names: Vec<_> = element.children.iter().filter_map(property_name).collect();
        names.sort_unstable_by_key(|e| e.0);
        if let Some(twice) = names.windows(2).find(|w| w[0].0 == w[1].0) {
            return Err(twice[1].1.error("given twice"));
        }
        let used = RefCell::new(vec![false; element.children.len()]);
        Ok(Self { element, used, asked: RefCell::default(), textures: RefCell::default() })
    }

    /// The plugin's type.
    pub(super) fn kind(&self) -> Result<&'a str, CliError> {
        self.element.required("type")
    }

    /// The children that `wanted` picks; they count as asked for.
    pub(super) fn children(&self, wanted: impl Fn(&'a Element) -> bool) -> Vec<&'a Element> {
        let mut found = Vec::new();
        for (child, used) in self.element.children.iter().zip(self.used.borrow_mut().iter_mut()) {
            if wanted(child) {
                *used = true;
                found.push(child);
            }
        }
        found
    }

    /// Whether an element is the property of a name.
    pub(super) fn is_property(&self, e: &Element, name: &str) -> bool {
        property_name(e).is_some_and(|(n, _)| n == name)
    }

    /// The property of a name, whatever its tag.
    pub(super) fn property(&self, name: &'static str) -> Option<&'a Element> {
        self.asked.borrow_mut().push(name);
        self.children(|e| property_name(e).is_some_and(|(n, _)| n == name)).first().copied()
    }

    /// A property with one of several tags, as what `parse` makes of it.
    pub(super) fn value<T>(
        &self,
        name: &'static str,
        tags: &[&str],
        parse: impl Fn(&'a Element) -> Result<T, CliError>,
    ) -> Result<Option<T>, CliError> {
        let Some(e) = self.property(name) else { return Ok(None) };
        if tags.contains(&e.tag.as_str()) {
            return parse(e).map(Some);
        }
        Err(e.error(format!("`{name}` must be a <{}>", tags.join("> or <"))))
    }

    /// A finite number, for which no texture stands.
    pub(super) fn number(&self, name: &'static str) -> Result<Option<f64>, CliError> {
        if self.varying(name).is_some() {
            return Err(no_texture(self.element, name));
        }
        self.value(name, &["float", "integer"], |e| match *plain_numbers(e)? {
            [v] => Ok(v),
            _ => Err(e.error("expected one number")),
        })
    }

    /// A whole number.
    pub(super) fn integer(&self, name: &'static str) -> Result<Option<i64>, CliError> {
        self.value(name, &["integer"], |e| {
            let text = plain_value(e)?;
            let bad = || e.error(format!("`{text}` is not a whole number"));
            text.trim().parse().map_err(|_| bad())
        })
    }

    /// A whole number within bounds.
    pub(super) fn integer_in<T: TryFrom<i64>>(
        &self,
        name: &'static str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<Option<T>, CliError> {
        let Some(v) = self.integer(name)? else { return Ok(None) };
        match T::try_from(v) {
            Ok(t) if range.contains(&v) => Ok(Some(t)),
            _ => Err(self.element.error(format!(
                "`{name}` is {v}; expected {} to {}",
                range.start(),
                range.end()
            ))),
        }
    }

    /// `true` or `false`.
    pub(super) fn boolean(&self, name: &'static str) -> Result<Option<bool>, CliError> {
        self.value(name, &["boolean"], |e| match plain_value(e)? {
            "true" => Ok(true),
            "false" => Ok(false),
            other => Err(e.error(format!("`{other}` is neither `true` nor `false`"))),
        })
    }

    /// A word or sentence.
    pub(super) fn string(&self, name: &'static str) -> Result<Option<&'a str>, CliError> {
        self.value(name, &["string"], plain_value)
    }

    /// A file that exists, wherever it is found.
    pub(super) fn path(&self, name: &'static str) -> Result<Option<PathBuf>, CliError> {
        self.string(name)?;
        let Some(file) = self.property(name).and_then(Element::file_name) else { return Ok(None) };
        let path = self.element.resolve(file)?;
        let fail = |reason| self.element.error(format!("cannot read {}: {reason}", path.display()));
        input_file::check(&path).map_err(|e| fail(e.to_string()))?;
        Ok(Some(path))
    }

    /// One of several words, as what it stands for.
    pub(super) fn choice<T: Copy>(
        &self,
        name: &'static str,
        choices: &[(&str, T)],
    ) -> Result<Option<T>, CliError> {
        let Some(word) = self.string(name)? else { return Ok(None) };
        match choices.iter().find(|(w, _)| *w == word) {
            Some((_, t)) => Ok(Some(*t)),
            None => {
                let words: Vec<_> = choices.iter().map(|(w, _)| *w).collect();
                let message = format!("`{name}` is `{word}`; expected {}", words.join(", "));
                Err(self.element.error(message))
            }
        }
    }

    /// A point or vector.
    pub(super) fn vector(&self, name: &'static str) -> Result<Option<Vec3>, CliError> {
        self.value(name, &["point", "vector"], |e| {
            e.only_attributes(&["name", "value", "x", "y", "z"])?;
            if e.attribute("value").is_some() {
                return triple(e, "value");
            }
            let axis = |key| number(e, key, e.required(key)?);
            Ok(vec3(axis("x")?, axis("y")?, axis("z")?))
        })
    }

    /// A placement.
    pub(super) fn transform(&self, name: &'static str) -> Result<Option<Affine>, CliError> {
        self.value(name, &["transform"], transform::parse)
    }

    /// The texture that varies and stands for a property, if one does; whatever else has the name is not asked for.
    pub(super) fn varying(&self, name: &str) -> Option<&'a Element> {
        let is_named = |e: &&Element| property_name(e).is_some_and(|(n, _)| n == name);
        self.element.children.iter().find(is_named).filter(|e| varies(e))
    }

    /// Keeps a texture that varies for whoever can use it, and returns its mean.
    pub(super) fn keep(&self, name: &'static str, texture: Texture) -> Rgb {
        let mean = texture.mean();
        self.textures.borrow_mut().push((name, texture));
        mean
    }

    /// True where a texture that varies was kept for a property.
    pub(super) fn is_textured(&self, name: &str) -> bool {
        self.textures.borrow().iter().any(|(n, _)| *n == name)
    }

    /// The texture kept for a property, to be used by whoever takes it.
    pub(super) fn take_texture(&self, name: &str) -> Option<Texture> {
        let mut textures = self.textures.borrow_mut();
        let i = textures.iter().position(|(n, _)| *n == name)?;
        Some(textures.remove(i).1)
    }

    /// The textures kept so far.
    pub(super) fn take_textures(&self) -> Vec<(&'static str, Texture)> {
        self.textures.take()
    }

    /// Accepts properties that do not change the expected image.
    pub(super) fn accept(&self, names: &[&'static str]) {
        for name in names {
            self.property(name);
        }
    }

    /// Accepts everything that is left.
    pub(super) fn accept_rest(&self) {
        self.children(|_| true);
    }

    /// Whether a property that nobody asked for only gets a note, which is so for what is known to be harmless in files of
    /// version 0.5 and 0.6. Any other may be a misspelt name.
    fn is_passed_over(&self, child: &Element) -> bool {
        let Some((name, _)) = property_name(child) else { return false };
        let plain = ["float", "integer", "boolean", "string"].contains(&child.tag.as_str());
        let harmless =
            (HARMLESS.iter()).any(|(tag, names)| *tag == self.element.tag && names.contains(&name));
        if !child.is_legacy() || !plain || !harmless {
            return false;
        }
        let kind = self.element.attribute("type").unwrap_or("");
        child.note_once(
            &format!("{}/{kind}/{name}", self.element.tag),
            format!("has no effect in {}, here and wherever it is given", self.element),
        );
        true
    }

    /// Refuses what nobody asked for.
    pub(super) fn finish(&self) -> Result<(), CliError> {
        if let Some((name, _)) = self.textures.borrow().first() {
            return Err(no_texture(self.element, name));
        }
        let used = self.used.borrow();
        let mut left = (self.element.children.iter().zip(used.iter()))
            .filter(|(child, used)| !**used && !self.is_passed_over(child));
        let Some((child, _)) = left.next() else { return Ok(()) };
        if property_name(child).is_none() {
            return Err(child.error(format!("not supported inside {}", self.element)));
        }
        let mut known = self.asked.borrow().clone();
        known.sort_unstable();
        known.dedup();
        let known = if known.is_empty() { "no properties".into() } else { known.join(", ") };
        Err(child.error(format!("not supported by {}, which takes {known}", self.element)))
    }
}

/// Name of a property, with its element; nested plugins and references may do without.
fn property_name(e: &Element) -> Option<(&str, &Element)> {
    // References to media share names by design: an interior and an exterior are told apart there.
    if e.tag == "ref" { None } else { e.attribute("name").map(|n| (n, e)) }
}

/// True for a texture that is not the same everywhere.
pub(super) fn varies(e: &Element) -> bool {
    e.tag == "texture"
        && e.attribute("type").is_some_and(|kind| {
            VARYING.contains(&kind) || (kind == "scale" && e.children.iter().any(varies))
        })
}

/// The error where a texture that varies stands for a property that only has one value.
pub(super) fn no_texture(at: &Element, name: &str) -> CliError {
    at.error(format!(
        "a texture cannot stand for `{name}` here; only BSDFs and area emitters have them"
    ))
}
