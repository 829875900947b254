//! OpenEXR: the image, derivatives, terms and standard errors as layers of one file.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Write};
use std::path::Path;

use drt_estimators::{Estimate, Layer, Rendering};
use drt_math::Rgb;
use exr::error::Error;
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::SmallVec;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, LayerAttributes, ReadChannels, ReadLayers,
    WritableImage,
};

use crate::CliError;
use crate::error::Place;
use crate::files::atomic::write_atomically;
use crate::files::{checksum, input_file, memory};

/// Where an image comes from; stored with it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The scene file.
    pub scene: String,
    /// The job file and its text, where there was one.
    pub job: Option<(String, String)>,
    /// Names the random numbers.
    pub seed: u64,
    /// Wall time spent.
    pub seconds: f64,
    /// A hash of all inputs, where somebody may ask whether they have changed.
    pub inputs: Option<String>,
    /// What a shard leaves to be merged.
    pub attachment: Option<Vec<u8>>,
}

/// The name of a layer, which is empty for the image itself, and its pixels, row by row from the top left.
pub type NamedLayer<'a> = (&'a str, &'a [[f32; 3]]);

/// An EXR file as read: colours by layer name, the plain `R`, `G`, `B` under the empty name.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ExrFile {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Pixels of each layer, row by row from the top left; missing channels are zero, and luminance alone is all three.
    pub layers: BTreeMap<String, Vec<[f32; 3]>>,
    /// Attributes, as text.
    pub attributes: BTreeMap<String, String>,
}

impl ExrFile {
    /// The layers in the order of the job that they come from: the image, then each derivative, with its terms after it, each before its
    /// standard errors. The format itself sorts channels by name, and so are the layers of files that do not tell an order.
    pub fn in_order(&self) -> impl Iterator<Item = NamedLayer<'_>> {
        let told = self.attributes.get(LAYERS).and_then(|told| serde_json::from_str(told).ok());
        let told: Vec<String> = told.unwrap_or_default();
        let place = |name: &str| told.iter().position(|n| n == name).unwrap_or(told.len());
        let mut layers: Vec<NamedLayer<'_>> =
            self.layers.iter().map(|(name, pixels)| (name.as_str(), &pixels[..])).collect();
        layers.sort_by_cached_key(|(name, _)| place(name));
        layers.into_iter()
    }
}

/// The attribute of the names of layers in their order, as a JSON array.
const LAYERS: &str = "drt_layers";
/// Attributes that tell what a file is the result of, and whether all of it.
const INPUTS: &str = "drt_inputs";
const COMPLETE: &str = "drt_complete";
/// The attribute of what a shard leaves.
const ATTACHMENT: &str = "drt_shard";
/// Most bytes that the format's headers hold in one.
const MOST_BYTES: usize = i32::MAX as usize;

/// Takes what a shard has left, [`Provenance::attachment`], out of the bytes of a file, whose path is for messages; `None`
/// where it is of no shard.
///
/// # Errors
/// When it is malformed.
pub fn attachment(path: &Path, file: &[u8]) -> Result<Option<Vec<u8>>, CliError> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(file), false)
        .map_err(|e| CliError::input(&Place::file(path), e))?;
    let of = |header: exr::meta::header::Header| match header
        .own_attributes
        .other
        .get(&text(ATTACHMENT))
    {
        Some(AttributeValue::Custom { bytes, .. }) => Some(bytes.to_vec()),
        _ => None,
    };
    Ok(meta.headers.into_iter().find_map(of))
}

/// True where a file is a complete result of inputs with this hash, [`Provenance::inputs`], by this version of the program.
pub fn is_result_of(path: &Path, inputs: &str) -> bool {
    let Ok(meta) = exr::meta::MetaData::read_from_file(path, false) else { return false };
    meta.headers.iter().any(|header| {
        let attributes = &header.own_attributes;
        let is =
            |name: &str, value: AttributeValue| attributes.other.get(&text(name)) == Some(&value);
        attributes.software_name == Some(text(crate::PROGRAM))
            && is(INPUTS, AttributeValue::Text(text(inputs)))
            && is(COMPLETE, AttributeValue::I32(1))
    })
}

pub(super) const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Writes a result, with further images (such as finite differences) by layer name.
///
/// ```
/// use std::path::Path;
///
/// use drt_cli::{Defaults, Provenance, decode_scene, read_exr, write_exr};
/// use drt_estimators::{Session, Settings, Unattended};
///
/// let scene = decode_scene(
///     br#"<scene version="3.0.0">
///          <sensor type="perspective">
///            <film type="hdrfilm">
///              <integer name="width" value="4"/>
///              <integer name="height" value="3"/>
///            </film>
///          </sensor>
///          <emitter type="constant" id="sky"/>
///        </scene>"#,
///     Path::new("scene.xml"),
///     &Defaults::new(),
/// )?;
/// let mut session = Session::new(&scene, &[], &Settings::default())?;
/// session.run(1, &Unattended);
///
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("sky.exr");
/// let provenance = Provenance { scene: "sky.xml".into(), ..Provenance::default() };
/// write_exr(&path, &session.rendering(), &[], &provenance)?;
/// let file = read_exr(&path)?;
/// assert_eq!((file.size, file.attributes["drt_scene"].as_str()), ([4, 3], "sky.xml"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the file cannot be written.
pub fn write_exr(
    path: &Path,
    rendering: &Rendering,
    further: &[(String, &Layer)],
    provenance: &Provenance,
) -> Result<(), CliError> {
    let [width, height] = rendering.image.size;
    if let Some(bytes) = provenance.attachment.as_ref().filter(|b| b.len() > MOST_BYTES) {
        let message = format!(
            "a shard of {} bytes does not fit; OpenEXR holds up to {MOST_BYTES}: make more shards",
            bytes.len()
        );
        return Err(CliError::write(path, message));
    }
    let mut channels: SmallVec<[_; 4]> = SmallVec::new();
    let mut names = Vec::new();
    for (name, layer) in layers(rendering, further) {
        let errors = if name.is_empty() { "stderr".into() } else { format!("{name}_stderr") };
        add_channels(&mut channels, &name, layer, |e| e.mean);
        add_channels(&mut channels, &errors, layer, |e| e.stderr);
        names.extend([name, errors]);
    }
    let layer = exr::prelude::Layer::new(
        (width as usize, height as usize),
        attributes(rendering, provenance, &names),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let image = exr::prelude::Image::from_layer(layer);
    if provenance.attachment.is_none() {
        return write_atomically(path, |out| Ok(image.write().non_parallel().to_buffered(out)?));
    }
    write_atomically(path, |out| {
        let mut file = Cursor::new(Vec::new());
        image.write().non_parallel().to_buffered(&mut file)?;
        let mut file = file.into_inner();
        checksum::seal(&mut file);
        Ok(out.write_all(&file)?)
    })
}

/// An EXR file of texels, row by row; `None` where their number is not that of the size.
#[must_use]
pub fn encode_texels([width, height]: [u32; 2], texels: &[Rgb]) -> Option<Vec<u8>> {
    let [width, height] = [width as usize, height as usize];
    let fits = texels.len() == width * height;
    let image = fits.then(|| {
        exr::prelude::Image::from_channels(
            (width, height),
            exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| {
                let [r, g, b] = texels[at.y() * width + at.x()].to_array().map(|v| v as f32);
                (r, g, b)
            }),
        )
    })?;
    let mut file = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut file).ok()?;
    Some(file.into_inner())
}

/// All images of a result by layer name.
fn layers<'a>(
    rendering: &'a Rendering,
    further: &'a [(String, &'a Layer)],
) -> impl Iterator<Item = (String, &'a Layer)> {
    let derivatives = rendering.derivatives.iter().flat_map(|d| {
        let terms = d.terms.iter();
        std::iter::once((format!("d_{}", d.name), &d.total))
            .chain(terms.map(|(term, layer)| (format!("d_{}.{}", d.name, term.name()), layer)))
    });
    std::iter::once((String::new(), &rendering.image))
        .chain(derivatives)
        .chain(further.iter().map(|(name, layer)| (name.clone(), *layer)))
}

fn add_channels(
    channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>,
    layer: &str,
    image: &Layer,
    part: impl Fn(&Estimate) -> Rgb,
) {
    for (c, channel) in CHANNELS.into_iter().enumerate() {
        let samples = image.pixels.iter().map(|p| part(p).to_array()[c] as f32).collect();
        let name = if layer.is_empty() { channel.into() } else { format!("{layer}.{channel}") };
        channels.push(AnyChannel::new(text(&name), FlatSamples::F32(samples)));
    }
}

fn attributes(rendering: &Rendering, provenance: &Provenance, names: &[String]) -> LayerAttributes {
    let string = |s: &str| AttributeValue::Text(text(s));
    let mut own = vec![
        ("drt_scene", string(&provenance.scene)),
        // As text: the format has no 64-bit integers.
        ("drt_seed", string(&provenance.seed.to_string())),
        ("drt_spp", string(&rendering.spp.to_string())),
        ("drt_seconds", AttributeValue::F64(provenance.seconds)),
        (COMPLETE, AttributeValue::I32(i32::from(rendering.complete))),
        // Serialising strings to memory has no way to fail.
        (LAYERS, string(&serde_json::to_string(names).unwrap_or_default())),
    ];
    own.extend(provenance.inputs.iter().map(|hash| (INPUTS, string(hash))));
    if let Some(bytes) = &provenance.attachment {
        let (kind, bytes) = (text("drt"), SmallVec::from_slice(bytes));
        own.push((ATTACHMENT, AttributeValue::Custom { kind, bytes }));
    }
    if let Some((job, job_text)) = &provenance.job {
        own.push(("drt_job", string(job)));
        own.push(("drt_job_text", string(job_text)));
    }
    LayerAttributes {
        software_name: Some(text(crate::PROGRAM)),
        other: own.into_iter().map(|(name, value)| (text(name), value)).collect(),
        ..LayerAttributes::default()
    }
}

/// UTF-8 in the format's byte strings.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

fn string(t: &Text) -> String {
    String::from_utf8_lossy(t.as_slice()).into_owned()
}

/// The plain colours of a file: all of `R`, `G` and `B`, or `Y` in place of them. `expected` judges the size before pixels
/// are read.
pub(super) fn read_plain(
    path: &Path,
    expected: impl Fn([u32; 2]) -> Result<(), CliError>,
) -> Result<Vec<[f32; 3]>, CliError> {
    let fail = |reason: &dyn std::fmt::Display| CliError::input(&Place::file(path), reason);
    let bytes = input_file::read_at(path, None)?;
    let headers = headers(&bytes, path)?;
    let mut names = Vec::new();
    for header in &headers {
        expected([header.layer_size.width() as u32, header.layer_size.height() as u32])?;
        if header.own_attributes.layer_name.is_none() {
            names.extend(header.channels.list.iter().map(|c| string(&c.name)));
        }
    }
    let has = |name: &&str| names.iter().any(|n| n == name);
    if !(CHANNELS.iter().all(has) || is_gray(has)) {
        let names =
            if names.is_empty() { "none outside of layers".into() } else { names.join(", ") };
        let message = format!("its channels are {names}; expected R, G and B, or Y for grey");
        return Err(fail(&message));
    }
    let pixels = decode(&bytes, path)?.layers.remove("");
    pixels.ok_or_else(|| fail(&"it has no channels R, G and B"))
}

/// True where luminance stands for all colours.
fn is_gray(has: impl Fn(&&str) -> bool) -> bool {
    has(&"Y") && !CHANNELS.iter().chain(&["RY", "BY"]).any(has)
}

/// The headers of a file, one for each part.
fn headers(
    bytes: &[u8],
    path: &Path,
) -> Result<SmallVec<[exr::meta::header::Header; 3]>, CliError> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false);
    Ok(meta.map_err(|e| CliError::input(&Place::file(path), e))?.headers)
}

/// Refuses a file whose pixels do not fit into memory.
fn check_memory(bytes: &[u8], path: &Path) -> Result<(), CliError> {
    let samples = |h: exr::meta::header::Header| {
        let pixels = h.layer_size.width() as u128 * h.layer_size.height() as u128;
        pixels * h.channels.list.len() as u128
    };
    // As read, and as colours.
    let room = 8 * headers(bytes, path)?.into_iter().map(samples).sum::<u128>();
    memory::check(room).map_err(|e| CliError::input(&Place::file(path), format!("its pixels {e}")))
}

/// Reads the colours of an EXR file of one or several parts. Where a layer has luminance alone, that is all of its colours.
///
/// # Errors
/// When it cannot be read, is malformed, has parts of several sizes or no colour channels.
pub fn read_exr(path: &Path) -> Result<ExrFile, CliError> {
    decode(&input_file::read_at(path, None)?, path)
}

/// Reads the bytes of an EXR file as [`read_exr`] does; errors call it by the given name.
///
/// # Errors
/// As [`read_exr`].
pub fn decode_exr(bytes: &[u8], name: &str) -> Result<ExrFile, CliError> {
    decode(bytes, Path::new(name))
}

fn decode(bytes: &[u8], path: &Path) -> Result<ExrFile, CliError> {
    let fail = |reason: &dyn std::fmt::Display| CliError::input(&Place::file(path), reason);
    check_memory(bytes, path)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e: Error| fail(&e))?;
    let mut file = ExrFile::default();
    for part in &image.layer_data {
        let size = [part.size.width() as u32, part.size.height() as u32];
        if file.layers.is_empty() {
            file.size = size;
        } else if file.size != size {
            return Err(fail(&"its parts differ in size; expected one size"));
        }
        let prefix = part.attributes.layer_name.as_ref().map(string);
        let names: BTreeSet<String> =
            part.channel_data.list.iter().map(|c| string(&c.name)).collect();
        for channel in &part.channel_data.list {
            let name = string(&channel.name);
            let (layer, channel_name) = name.rsplit_once('.').unwrap_or(("", &name));
            let beside = |other: &&str| match layer {
                "" => names.contains(*other),
                layer => names.contains(&format!("{layer}.{other}")),
            };
            let own = match CHANNELS.iter().position(|n| *n == channel_name) {
                Some(c) => c..c + 1,
                None if channel_name == "Y" && is_gray(beside) => 0..3,
                None => continue,
            };
            if channel.sample_data.len() != part.size.width() * part.size.height() {
                return Err(fail(&format!("its channel {name} has not one sample per pixel")));
            }
            let layer = match prefix.as_deref() {
                Some(prefix) if layer.is_empty() => prefix.into(),
                Some(prefix) => format!("{prefix}.{layer}"),
                None => layer.into(),
            };
            let pixels = file.layers.entry(layer);
            let pixels = pixels.or_insert_with(|| vec![[0.0; 3]; channel.sample_data.len()]);
            for (pixel, value) in pixels.iter_mut().zip(channel.sample_data.values_as_f32()) {
                pixel[own.clone()].fill(value);
            }
        }
        let standard = part.attributes.software_name.iter().map(|s| ("software".into(), string(s)));
        let other = part.attributes.other.iter().chain(&image.attributes.other);
        file.attributes.extend(standard);
        file.attributes.extend(other.filter_map(|(k, v)| Some((string(k), show(v)?))));
    }
    if file.layers.is_empty() {
        return Err(fail(&"it has no channels R, G or B, nor Y"));
    }
    Ok(file)
}

fn show(value: &AttributeValue) -> Option<String> {
    match value {
        AttributeValue::Text(t) => Some(string(t)),
        AttributeValue::F64(v) => Some(v.to_string()),
        AttributeValue::I32(v) => Some(v.to_string()),
        _ => None,
    }
}
