//! Quantities in space: numbers, colours, `constvolume` and `gridvolume`.

use drt_math::{Affine, Rgb};
use drt_medium::{Filter, Grid, Layout, Volume, Wrap, nanovdb, vol};

use super::Loader;
use super::element::Element;
use super::properties::Properties;
use crate::CliError;

/// A quantity in space, and the box in which it counts as a density.
pub(super) struct Field {
    pub(super) volume: Volume,
    /// The image of the unit cube that bounds a constant density.
    pub(super) placement: Affine,
}

impl Field {
    pub(super) fn constant(value: Rgb) -> Self {
        Self { volume: Volume::Constant(value), placement: Affine::IDENTITY }
    }

    /// The value of a quantity that is the same everywhere.
    pub(super) fn as_constant(&self) -> Option<Rgb> {
        match &self.volume {
            Volume::Constant(c) => Some(*c),
            Volume::Grid(_) => None,
        }
    }
}

impl<'a> Loader<'a> {
    /// The quantity of a name: a volume, a colour or a number.
    pub(super) fn field(
        &self,
        p: &Properties<'a>,
        name: &'static str,
    ) -> Result<Option<Field>, CliError> {
        match self.index.single(p, "volume", Some(name))? {
            Some(volume) => read(volume.target, Values::NotNegative).map(Some),
            None => Ok(p.uniform_color(name)?.map(Field::constant)),
        }
    }
}

/// What the values of a grid may be.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Values {
    NotNegative,
    Any,
}

/// A `<volume>` element.
pub(super) fn read(e: &Element, values: Values) -> Result<Field, CliError> {
    let p = Properties::of(e)?;
    let field = match p.kind()? {
        "constvolume" => constant(&p)?,
        "gridvolume" => grid(&p, values)?,
        other => {
            return Err(e.error(format!(
                "the volume type `{other}` is not supported; expected gridvolume or constvolume"
            )));
        }
    };
    p.finish()?;
    Ok(field)
}

fn constant(p: &Properties<'_>) -> Result<Field, CliError> {
    let value = p.uniform_color("value")?.ok_or_else(|| p.element.error("`value` is missing"))?;
    let placement = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
    Ok(Field { volume: Volume::Constant(value), placement })
}

/// The grid with values a little below zero, as simulations and filters leave them, at zero.
fn not_negative(p: &Properties<'_>, grid: Grid) -> Result<Grid, CliError> {
    /// How much below zero they may be, of the largest value.
    const LITTLE: f64 = 0.01;
    let values = grid.values();
    let least = values.iter().copied().fold(0.0, f64::min);
    let largest = values.iter().copied().fold(0.0, f64::max);
    if !(least < 0.0 && least >= -LITTLE * largest) {
        return Ok(grid);
    }
    let count = values.iter().filter(|v| **v < 0.0).count();
    p.element.note(format!(
        "{count} of {} values are below zero, the least {least:.3e}; they count as zero",
        values.len()
    ));
    let values = values.iter().map(|v| v.max(0.0)).collect();
    Grid::new(grid.size(), grid.channels(), values).map_err(|err| p.element.error(err))
}

fn grid(p: &Properties<'_>, values: Values) -> Result<Field, CliError> {
    let e = p.element;
    let path = p.path("filename")?.ok_or_else(|| e.error("`filename` is missing"))?;
    let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
    let filters = [("trilinear", Filter::Trilinear), ("nearest", Filter::Nearest)];
    let wraps = [("clamp", Wrap::Clamp), ("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror)];
    let filter = p.choice("filter_type", &filters)?.unwrap_or_default();
    let wrap = p.choice("wrap_mode", &wraps)?.unwrap_or_default();
    // Files of Mitsuba 0.5 and 0.6 place a grid in the box stored with it, its outermost values on
    // the faces.
    let legacy = e.is_legacy();
    let in_stored_box = p.boolean("use_grid_bbox")?.unwrap_or(legacy);
    let layout = if legacy { Layout::NodeCentred } else { Layout::VoxelCentred };
    // Spectral upsampling and texture hardware.
    p.accept(&["raw", "accel", "send_data"]);
    let is_tree = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("nvdb"));
    let (grid, placement) = if is_tree {
        let name = p.string("grid_name")?;
        let file = nanovdb::read(&path, name).map_err(|err| e.error(err))?;
        (file.grid, file.placement)
    } else {
        let file = vol::read(&path).map_err(|err| e.error(err))?;
        let placement = file.placement();
        (file.grid, placement)
    };
    let stored = if in_stored_box { placement } else { Affine::IDENTITY };
    let grid = if values == Values::Any { grid } else { not_negative(p, grid)? };
    let grid = (grid.with_layout(layout).with_filter(filter).with_wrap(wrap))
        .with_placement(to_world.after(&stored))
        .map_err(|err| e.error(err))?;
    Ok(Field { placement: *grid.to_world(), volume: Volume::Grid(grid) })
}
