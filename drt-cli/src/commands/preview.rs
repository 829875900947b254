//! `drt preview`: layers of an EXR file, to look at.

use super::Outcome;
use super::destinations::{Destinations, check_ending};
use super::options::PreviewOptions;
use crate::error::Place;
use crate::files::image::{is_error, write_layers};
use crate::{CliError, read_exr};

pub(super) fn run(options: &PreviewOptions) -> Result<Outcome, CliError> {
    let input = &options.input;
    let output = options.output.clone().unwrap_or_else(|| input.with_extension("png"));
    let destinations = Destinations::new([("-o", Some(output.as_path()))]);
    destinations.spare([input.as_path()])?;
    destinations.check()?;
    check_ending("-o", &output, &["png"])?;
    let file = read_exr(input)?;
    let all = file.layers.iter().map(|(name, pixels)| (name.as_str(), &pixels[..]));
    let mut layers: Vec<_> = all.clone().filter(|(name, _)| !is_error(name)).collect();
    if !options.layer.is_empty() {
        layers.clear();
        for wanted in &options.layer {
            let name = if wanted == "image" { "" } else { wanted };
            let known = || {
                let names = all.clone().map(|(n, _)| if n.is_empty() { "image" } else { n });
                names.collect::<Vec<_>>().join(", ")
            };
            let layer = all.clone().find(|(n, _)| *n == name).ok_or_else(|| {
                let message = format!("it has no layer `{wanted}`; it has {}", known());
                CliError::input(&Place::file(input), message)
            })?;
            layers.push(layer);
        }
    }
    if layers.is_empty() {
        return Err(CliError::input(&Place::file(input), "it has no layers but standard errors"));
    }
    write_layers(&output, file.size, &layers, options.look.tone(None))?;
    Ok(Outcome::Done)
}
