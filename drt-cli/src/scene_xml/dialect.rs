//! The dialects of Mitsuba XML: which one a file is written in, and one spelling for all names.

use crate::CliError;
use crate::error::Place;

/// The dialect a file is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    /// Mitsuba 0.5 and 0.6: `camelCase`, spectra as RGB triples, volumes in their file's box.
    Legacy,
    /// Mitsuba 3: `snake_case`.
    Current,
}

impl Dialect {
    /// The dialect of a version such as `0.6.0` or `3.0.0`.
    pub(super) fn of_version(version: &str, place: &Place) -> Result<Self, CliError> {
        let bad = || {
            let message = format!(
                "version `{version}` of the scene format is not known; expected 0.5 to 0.6, \
                 or 2.0 and later"
            );
            CliError::input(place, message)
        };
        let mut parts = version.split('.').map(str::parse::<u32>);
        let major = parts.next().and_then(Result::ok).ok_or_else(bad)?;
        let minor = parts.next().unwrap_or(Ok(0)).map_err(|_| bad())?;
        match (major, minor) {
            (0, 5 | 6) => Ok(Self::Legacy),
            (2.., _) => Ok(Self::Current),
            _ => Err(bad()),
        }
    }

    /// A property name in snake case.
    pub(super) fn property_name(self, name: &str) -> String {
        match self {
            Self::Legacy => snake_case(name),
            Self::Current => name.to_owned(),
        }
    }
}

/// `sigmaT` to `sigma_t`, `intIOR` to `int_ior`: an underscore where a small letter meets a
/// capital, as Mitsuba 3 converts old files.
fn snake_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 2);
    let mut after_small = false;
    for c in name.chars() {
        if after_small && c.is_ascii_uppercase() {
            out.push('_');
        }
        after_small = c.is_ascii_lowercase() || c.is_ascii_digit();
        out.push(c.to_ascii_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_old_files_become_snake_case() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("sigmaT", "sigma_t"),
            ("rrDepth", "rr_depth"),
            ("faceNormals", "face_normals"),
            ("g", "g"),
            ("sigma_t", "sigma_t"),
            ("diffuseReflectance", "diffuse_reflectance"),
        ] {
            assert_eq!(Dialect::Legacy.property_name(old), new);
        }
        assert_eq!(Dialect::Current.property_name("toWorld"), "toWorld");
    }

    #[test]
    fn versions_name_their_dialect() {
        let place = Place::file(std::path::Path::new("s.xml"));
        let of = |v| Dialect::of_version(v, &place);
        assert_eq!(of("0.5.0").unwrap(), Dialect::Legacy);
        assert_eq!(of("0.6").unwrap(), Dialect::Legacy);
        assert_eq!(of("3.0.0").unwrap(), Dialect::Current);
        assert_eq!(of("2").unwrap(), Dialect::Current);
        for bad in ["0.4.0", "1.0", "three", "", "0.x"] {
            assert!(of(bad).unwrap_err().to_string().contains("expected 0.5"), "{bad}");
        }
    }
}
