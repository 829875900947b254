//! Measured materials, from files.

use std::path::Path;
use std::sync::Arc;

use drt_estimators::surface::Measured;

use super::super::Loader;
use super::super::properties::Properties;
use crate::CliError;
use crate::files::{input_file, measured_file};

impl Loader<'_> {
    pub(super) fn measured(&self, p: &Properties<'_>) -> Result<Arc<Measured>, CliError> {
        let e = p.element;
        let path = p.path("filename")?.ok_or_else(|| e.error("`filename` is missing"))?;
        let mut known = self.measured.borrow_mut();
        if let Some(material) = known.get(&path) {
            return Ok(Arc::clone(material));
        }
        let material =
            read(&path).map_err(|reason| e.error(format!("{}: {reason}", path.display())))?;
        let material = Arc::new(material);
        known.insert(path, Arc::clone(&material));
        Ok(material)
    }
}

fn read(path: &Path) -> Result<Measured, String> {
    let bytes = input_file::read(path).map_err(|err| format!("cannot read this file: {err}"))?;
    Measured::new(measured_file::decode(&bytes)?).map_err(|err| err.to_string())
}
