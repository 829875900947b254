//! Files of measured materials: tensor files with the fields of [`MeasuredTables`], those of the RGL database in its RGB version.

use drt_estimators::surface::{MeasuredTables, Tensor};

use crate::files::tensor_file::{self, TensorFile, Values};

/// Reads the tables of a file, not yet checked for making a material, from its bytes.
///
/// # Errors
/// Names the field that is missing, or has another type or shape than it should.
pub fn decode(bytes: &[u8]) -> Result<MeasuredTables, String> {
    let file = TensorFile::new(bytes)?;
    if !file.has("rgb") && file.has("spectra") {
        return Err("it has `spectra`, but no `rgb`; take the RGB file of the material".into());
    }
    let tensor = |name| {
        let (shape, values) = file.floats(name)?;
        Ok::<Tensor, String>(Tensor { shape, values })
    };
    let list = |name| match tensor(name)? {
        Tensor { shape, values } if shape.len() == 1 => Ok(values),
        Tensor { shape, .. } => {
            Err(format!("`{name}` has the shape {shape:?}; expected one dimension"))
        }
    };
    Ok(MeasuredTables {
        phi_i: list("phi_i")?,
        theta_i: list("theta_i")?,
        ndf: tensor("ndf")?,
        sigma: tensor("sigma")?,
        vndf: tensor("vndf")?,
        luminance: tensor("luminance")?,
        rgb: tensor("rgb")?,
        jacobian: match file.bytes("jacobian")? {
            [flag] => *flag != 0,
            other => return Err(format!("`jacobian` has {} values; expected 1", other.len())),
        },
    })
}

/// The file of a measured material, as the BSDF `measured` of scenes reads it, here as in Mitsuba.
#[must_use]
pub fn encode_measured(tables: &MeasuredTables) -> Vec<u8> {
    let list = |values: &[f32]| (vec![values.len()], Values::Floats(values.to_vec()));
    let tensor = |t: &Tensor| (t.shape.clone(), Values::Floats(t.values.clone()));
    let bytes = |values: &[u8]| (vec![values.len()], Values::Bytes(values.to_vec()));
    tensor_file::encode(&[
        ("description", bytes(b"a measured material")),
        ("phi_i", list(&tables.phi_i)),
        ("theta_i", list(&tables.theta_i)),
        ("ndf", tensor(&tables.ndf)),
        ("sigma", tensor(&tables.sigma)),
        ("vndf", tensor(&tables.vndf)),
        ("luminance", tensor(&tables.luminance)),
        ("rgb", tensor(&tables.rgb)),
        ("jacobian", bytes(&[u8::from(tables.jacobian)])),
    ])
}
