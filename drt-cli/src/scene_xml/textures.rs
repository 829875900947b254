//! Textures that vary over surfaces: `bitmap`, `checkerboard`, `mesh_attribute` and `volume`.

use std::path::Path;
use std::sync::Arc;

use drt_estimators::texture::{
    AttributeTexture, Bitmap, Texture, TextureFilter, TextureWrap, UvMap, VolumeTexture,
};
use drt_math::{Affine, Mat3, Rgb, vec3};

use super::element::Element;
use super::properties::Properties;
use super::spectrum::{factor, scaled, srgb_to_linear};
use super::volumes;
use crate::files::memory;
use crate::files::pfm::{self, Pixels};
use crate::{CliError, read_exr};

/// Images of more texels are refused: they would take gigabytes.
const MAX_TEXELS: u64 = 1 << 26;

/// A texture with all its colours multiplied.
fn times(texture: Texture, factor: Rgb) -> Result<Texture, String> {
    Ok(match texture {
        Texture::Checkerboard { colours, to_uv } => {
            Texture::Checkerboard { colours: colours.map(|c| c * factor), to_uv }
        }
        Texture::Attribute(a) if factor.r == factor.g && factor.g == factor.b => {
            Texture::Attribute(AttributeTexture { scale: a.scale * factor.r, ..a })
        }
        Texture::Attribute(_) => return Err("an attribute is multiplied by one number".into()),
        Texture::Volume(_) => return Err("a volume is not multiplied".into()),
        Texture::Bitmap(image) => {
            let factor = factor.to_array();
            Texture::Bitmap(image.map(|t| [0, 1, 2].map(|k| (f64::from(t[k]) * factor[k]) as f32))?)
        }
    })
}

/// A texture that varies, of colours.
pub(super) fn read(e: &Element) -> Result<Texture, CliError> {
    let p = Properties::of(e)?;
    if let "mesh_attribute" | "volume" = p.kind()? {
        let texture = if p.kind()? == "volume" { volume(&p) } else { attribute(&p) }?;
        p.finish()?;
        return Ok(texture);
    }
    if p.kind()? == "scale" {
        let inner = read(scaled(&p)?)?;
        let texture = times(inner, factor(&p)?).map_err(|reason| e.error(reason))?;
        p.finish()?;
        return Ok(texture);
    }
    let to_uv = uv_map(&coordinates(&p)?);
    let texture = if p.kind()? == "checkerboard" {
        let colour = |name, default| {
            Ok::<_, CliError>(p.uniform_color(name)?.unwrap_or(Rgb::splat(default)))
        };
        Texture::Checkerboard { colours: [colour("color0", 0.4)?, colour("color1", 0.2)?], to_uv }
    } else {
        bitmap(&p, to_uv)?
    };
    p.finish()?;
    Ok(texture)
}

/// The same as a number: the luminance of every colour in all channels.
pub(super) fn luminance(texture: Texture) -> Result<Texture, String> {
    Ok(match texture {
        Texture::Checkerboard { colours, to_uv } => {
            let [a, b] = colours.map(|c| Rgb::splat(grey(c.to_array())));
            // Where it stands for a number, Mitsuba 3's checkerboard has its colours the other way round.
            let colours = [b, a];
            Texture::Checkerboard { colours, to_uv }
        }
        Texture::Attribute(a) => Texture::Attribute(AttributeTexture { grey: true, ..a }),
        Texture::Volume(v) => Texture::Volume(VolumeTexture { grey: true, ..v }),
        Texture::Bitmap(image) => Texture::Bitmap(image.map(|t| {
            let [r, g, b] = t.map(f64::from);
            // Exact for what is grey already.
            if t[0] == t[1] && t[1] == t[2] { t } else { [grey([r, g, b]) as f32; 3] }
        })?),
    })
}

fn attribute(p: &Properties<'_>) -> Result<Texture, CliError> {
    let e = p.element;
    let name = p.string("name")?.ok_or_else(|| e.error("`name` is missing"))?;
    if !["vertex_", "face_"].iter().any(|start| name.starts_with(start)) {
        let message = format!("`name` is `{name}`; expected it to begin with vertex_ or face_");
        return Err(e.error(message));
    }
    let scale = p.number("scale")?.unwrap_or(1.0);
    Ok(Texture::Attribute(AttributeTexture { name: name.into(), scale, grey: false }))
}

/// The values of space where a surface stands in the scene file.
fn volume(p: &Properties<'_>) -> Result<Texture, CliError> {
    let e = p.property("volume").ok_or_else(|| p.element.error("`volume` is missing"))?;
    if e.tag != "volume" {
        return Err(e.error("`volume` must be a <volume>"));
    }
    let volume = Arc::new(volumes::read(e, volumes::Values::NotNegative)?.volume);
    Ok(Texture::Volume(VolumeTexture { volume, grey: false }))
}

/// The luminance of a colour.
pub(super) fn grey([r, g, b]: [f64; 3]) -> f64 {
    0.212_671 * r + 0.715_160 * g + 0.072_169 * b
}

/// What is done to texture coordinates first: `to_uv`, or the scales and offsets of version 0.5 and 0.6.
fn coordinates(p: &Properties<'_>) -> Result<Affine, CliError> {
    if !p.element.is_legacy() {
        return Ok(p.transform("to_uv")?.unwrap_or(Affine::IDENTITY));
    }
    let number = |name, default| Ok::<f64, CliError>(p.number(name)?.unwrap_or(default));
    let scale = vec3(number("uscale", 1.0)?, number("vscale", 1.0)?, 1.0);
    let translation = vec3(number("uoffset", 0.0)?, number("voffset", 0.0)?, 0.0);
    Ok(Affine { linear: Mat3::diagonal(scale), translation })
}

fn uv_map(map: &Affine) -> UvMap {
    let [x, y, _] = map.linear.cols;
    let t = map.translation;
    UvMap([[x.x, y.x, t.x], [x.y, y.y, t.y]])
}

fn bitmap(p: &Properties<'_>, to_uv: UvMap) -> Result<Texture, CliError> {
    let e = p.element;
    let path = p.path("filename")?.ok_or_else(|| e.error("`filename` is missing"))?;
    let filters = [("bilinear", TextureFilter::Bilinear), ("nearest", TextureFilter::Nearest)];
    // Of version 0.5 and 0.6. Many samples see the same without means over what a pixel covers.
    let means = [("trilinear", TextureFilter::Bilinear), ("ewa", TextureFilter::Bilinear)];
    let filters = if e.is_legacy() { [&filters[..], &means].concat() } else { filters.to_vec() };
    let wraps = [
        ("repeat", TextureWrap::Repeat),
        ("mirror", TextureWrap::Mirror),
        ("clamp", TextureWrap::Clamp),
    ];
    let filter = p.choice("filter_type", &filters)?.unwrap_or_default();
    let wrap = p.choice("wrap_mode", &wraps)?;
    let wrap = if e.is_legacy() { wrap.or(both_ways(p, &wraps)?) } else { wrap };
    let wrap = wrap.unwrap_or_default();
    let curve = curve(p)?;
    // How it is stored and looked up.
    p.accept(&["accel", "format"]);
    let fail = |reason: String| e.error(format!("{}: {reason}", path.display()));
    let (size, mut texels) = pixels(&path, curve != Curve::OfFile).map_err(fail)?;
    if let Curve::Power(gamma) = curve {
        texels.iter_mut().flatten().for_each(|v| *v = v.max(0.0).powf(gamma));
    }
    let mut image = Bitmap::new(size, texels).map_err(fail)?;
    (image.filter, image.wrap, image.to_uv) = (filter, wrap, to_uv);
    Ok(Texture::Bitmap(image))
}

/// How the numbers of an image file become values.
#[derive(Clone, Copy, PartialEq)]
enum Curve {
    /// Values are decoded by the sRGB curve, unless the format holds linear ones.
    OfFile,
    /// They are values.
    Raw,
    /// Values are decoded by a power.
    Power(f32),
}

/// What `raw` says, or the `gamma` of version 0.5 and 0.6, where 1 is linear and -1 as the file is.
fn curve(p: &Properties<'_>) -> Result<Curve, CliError> {
    if !p.element.is_legacy() {
        return Ok(if p.boolean("raw")?.unwrap_or(false) { Curve::Raw } else { Curve::OfFile });
    }
    match p.number("gamma")? {
        None | Some(-1.0) => Ok(Curve::OfFile),
        Some(1.0) => Ok(Curve::Raw),
        Some(gamma) if gamma > 0.0 => Ok(Curve::Power(gamma as f32)),
        Some(gamma) => {
            Err(p.element.error(format!("`gamma` is {gamma}; expected a positive number or -1")))
        }
    }
}

/// What `wrap_mode_u` and `wrap_mode_v` of version 0.5 and 0.6 say, which must be the same.
fn both_ways(
    p: &Properties<'_>,
    wraps: &[(&str, TextureWrap)],
) -> Result<Option<TextureWrap>, CliError> {
    match (p.choice("wrap_mode_u", wraps)?, p.choice("wrap_mode_v", wraps)?) {
        (None, None) => Ok(None),
        (u, v) if u.unwrap_or_default() == v.unwrap_or_default() => Ok(u.or(v)),
        _ => Err(p.element.error("`wrap_mode_u` and `wrap_mode_v` must be the same")),
    }
}

/// Linear pixels of an image file, or those it holds where it is `raw`.
pub(super) fn pixels(path: &Path, raw: bool) -> Result<Pixels, String> {
    if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("exr")) {
        return exr_pixels(path);
    }
    if let Some((size, texels)) = pfm::read(path)? {
        return Ok((small(size)?, texels));
    }
    let reader = image::ImageReader::open(path).and_then(image::ImageReader::with_guessed_format);
    let reader = reader.map_err(|err| err.to_string())?;
    // Of these formats only Radiance's holds linear values.
    let linear = raw || reader.format() == Some(image::ImageFormat::Hdr);
    // Sizes are known before anything is made room for.
    let decoder = reader.into_decoder().map_err(|err| err.to_string())?;
    let (width, height) = image::ImageDecoder::dimensions(&decoder);
    let size = small([width, height])?;
    claimed(path, image::ImageDecoder::total_bytes(&decoder))?;
    let image = image::DynamicImage::from_decoder(decoder).map_err(|err| err.to_string())?;
    let image = image.into_rgb32f();
    let value = |v: f32| if linear { v } else { srgb_to_linear(f64::from(v)) as f32 };
    Ok((size, image.pixels().map(|p| p.0.map(value)).collect()))
}

/// The channels R, G and B, or Y in place of all three.
fn exr_pixels(path: &Path) -> Result<Pixels, String> {
    use exr::prelude::{ReadChannels as _, ReadLayers as _};

    let meta = exr::meta::MetaData::read_from_file(path, false).map_err(|err| err.to_string())?;
    let header = meta.headers.first().ok_or("there is no image in it")?;
    let size = [header.layer_size.width(), header.layer_size.height()];
    small(size.map(|n| u32::try_from(n).unwrap_or(u32::MAX)))?;
    let samples: usize =
        header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    claimed(path, (size[0] as u64).saturating_mul(size[1] as u64).saturating_mul(samples as u64))?;
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let has = |name: &str| names.iter().any(|n| n == name);
    if ["R", "G", "B"].into_iter().all(has) {
        let mut file = read_exr(path).map_err(|err| err.to_string())?;
        let texels = file.layers.remove("").ok_or("it has no channels R, G, B")?;
        return Ok((file.size, texels));
    }
    if !has("Y") || has("RY") || has("BY") {
        let names = names.join(", ");
        return Err(format!("its channels are {names}; expected R, G and B, or Y"));
    }
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .map_err(|err| err.to_string())?;
    let layer = file.layer_data;
    let grey = layer.channel_data.list.iter().find(|c| c.name.eq("Y"));
    let grey = grey.ok_or("it has no channel Y")?.sample_data.values_as_f32();
    let size = [layer.size.width() as u32, layer.size.height() as u32];
    Ok((size, grey.map(|v| [v; 3]).collect()))
}

/// Refuses a header that claims more bytes than the file can hold.
fn claimed(path: &Path, bytes: u64) -> Result<(), String> {
    let length = std::fs::metadata(path).map_err(|err| err.to_string())?.len();
    memory::plausible(bytes, length)
}

fn small(size: [u32; 2]) -> Result<[u32; 2], String> {
    let [width, height] = size.map(u64::from);
    if width * height <= MAX_TEXELS {
        Ok(size)
    } else {
        Err(format!("{width}x{height} pixels are too many; at most {MAX_TEXELS} fit"))
    }
}
