//! Quantities in space: numbers, colours, `constvolume` and `gridvolume`.

use std::path::PathBuf;

use drt_math::{Affine, Rgb};
use drt_medium::vol::{self, VolFile};
use drt_medium::{Filter, Grid, Layout, Volume, Wrap, nanovdb};

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

/// How a `gridvolume` joins its values, and where it is.
struct Joined {
    layout: Layout,
    filter: Filter,
    wrap: Wrap,
    to_world: Affine,
    in_stored_box: bool,
}

impl Joined {
    fn of(p: &Properties<'_>) -> Result<Self, CliError> {
        let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
        let filters = [("trilinear", Filter::Trilinear), ("nearest", Filter::Nearest)];
        let wraps = [("clamp", Wrap::Clamp), ("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror)];
        let filter = p.choice("filter_type", &filters)?.unwrap_or_default();
        let wrap = p.choice("wrap_mode", &wraps)?.unwrap_or_default();
        // Files of Mitsuba 0.5 and 0.6 place a grid in the box stored with it, its outermost values on
        // the faces.
        let legacy = p.element.is_legacy();
        let in_stored_box = p.boolean("use_grid_bbox")?.unwrap_or(legacy);
        let layout = if legacy { Layout::NodeCentred } else { Layout::VoxelCentred };
        // Spectral upsampling and texture hardware.
        p.accept(&["raw", "accel", "send_data"]);
        Ok(Self { layout, filter, wrap, to_world, in_stored_box })
    }

    /// A grid of a file, stored with a placement.
    fn place(&self, e: &Element, grid: Grid, placement: Affine) -> Result<Grid, CliError> {
        let stored = if self.in_stored_box { placement } else { Affine::IDENTITY };
        (grid.with_layout(self.layout).with_filter(self.filter).with_wrap(self.wrap))
            .with_placement(self.to_world.after(&stored))
            .map_err(|err| e.error(err))
    }
}

fn filename(p: &Properties<'_>) -> Result<PathBuf, CliError> {
    p.path("filename")?.ok_or_else(|| p.element.error("`filename` is missing"))
}

fn grid(p: &Properties<'_>, values: Values) -> Result<Field, CliError> {
    let e = p.element;
    let path = filename(p)?;
    let joined = Joined::of(p)?;
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
    let grid = if values == Values::Any { grid } else { not_negative(p, grid)? };
    let grid = joined.place(e, grid, placement)?;
    Ok(Field { placement: *grid.to_world(), volume: Volume::Grid(grid) })
}

/// A `<volume>` element of symmetric matrices, as one grid of their diagonals and one of what is off these.
pub(super) fn read_matrices(e: &Element) -> Result<[Grid; 2], CliError> {
    let p = Properties::of(e)?;
    if p.kind()? != "gridvolume" {
        return Err(e.error("matrices are given by a gridvolume of six channels"));
    }
    let joined = Joined::of(&p)?;
    let [diagonal, off_diagonal] = vol::read_matrices(filename(&p)?).map_err(|err| e.error(err))?;
    let placement = diagonal.placement();
    let place = |file: VolFile| joined.place(e, file.grid, placement);
    let grids = [place(diagonal)?, place(off_diagonal)?];
    p.finish()?;
    Ok(grids)
}
