//! `drt preview`: layers of an EXR file, to look at.

use std::path::Path;

use super::Outcome;
use super::destinations::{Destinations, check_ending};
use super::options::PreviewOptions;
use crate::error::Place;
use crate::files::image::{ExrFile, NamedLayer, is_error, write_layers};
use crate::{CliError, read_exr};

pub(super) fn run(options: &PreviewOptions) -> Result<Outcome, CliError> {
    let input = &options.input;
    let output = options.output.clone().unwrap_or_else(|| input.with_extension("png"));
    let destinations = Destinations::new([("-o", Some(output.as_path()))]);
    destinations.spare([input.as_path()])?;
    destinations.check()?;
    check_ending("-o", &output, &["png"])?;
    let file = read_exr(input)?;
    let layers = chosen(input, &file, &options.layers.names)?;
    write_layers(&output, file.size, &layers, options.layers.look.tone(None))?;
    Ok(Outcome::Done)
}

/// The layers of a file that are asked for by name, in that order, or else all but standard errors, in the order of their job.
pub(super) fn chosen<'f>(
    path: &Path,
    file: &'f ExrFile,
    names: &[String],
) -> Result<Vec<NamedLayer<'f>>, CliError> {
    let fail = |message: String| CliError::input(&Place::file(path), message);
    let all: Vec<_> = file.in_order().collect();
    if names.is_empty() {
        let layers: Vec<_> = all.into_iter().filter(|(name, _)| !is_error(name)).collect();
        let none = || fail("it has no layers but standard errors".into());
        return (!layers.is_empty()).then_some(layers).ok_or_else(none);
    }
    let shown = |name: &'f str| if name.is_empty() { "image" } else { name };
    let layer = |wanted: &String| {
        all.iter().copied().find(|(name, _)| shown(name) == wanted).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|(name, _)| shown(name)).collect();
            fail(format!("it has no layer `{wanted}`; it has {}", known.join(", ")))
        })
    };
    names.iter().map(layer).collect()
}
