//! Writes the density of the example scene `smoke`: a plume that winds upwards, in the unit cube.
//!
//! `cargo run --release -p drt-medium --features vol --example write_smoke -- smoke.vol`

/// The density of the plume at a point of the unit cube, y up: puffs along a rising helix that widens,
/// faded out towards the faces. What is too thin to be seen is cut off.
#[cfg(feature = "vol")]
fn plume(x: drt_math::Vec3) -> f64 {
    use drt_math::vec3;

    const PUFFS: u32 = 14;
    const THINNEST: f64 = 0.03;
    let puff = |i: u32| {
        let height = f64::from(i) / f64::from(PUFFS - 1);
        let (s, c) = (9.0 * height).sin_cos();
        let reach = 0.04 + 0.2 * height;
        let middle = vec3(0.5 + reach * c, 0.12 + 0.72 * height, 0.5 + reach * s);
        let width = 0.055 + 0.05 * height;
        (-(x - middle).length_squared() / (2.0 * width * width)).exp()
    };
    let fade = |v: f64| (4.0 * v * (1.0 - v)).powf(0.25);
    let sum: f64 = (0..PUFFS).map(puff).sum();
    let density = sum.min(1.0) * fade(x.x) * fade(x.y) * fade(x.z);
    (density - THINNEST).max(0.0)
}

#[cfg(feature = "vol")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use drt_math::{Vec3, vec3};
    use drt_medium::Grid;
    use drt_medium::vol::{self, VolFile};

    const SIZE: usize = 24;
    let path = std::env::args_os().nth(1).ok_or("expected the file to write")?;
    let along = |i: usize| (i as f64 + 0.5) / SIZE as f64;
    let cell = |n: usize| {
        let (i, j, k) = (n % SIZE, n / SIZE % SIZE, n / (SIZE * SIZE));
        plume(vec3(along(i), along(j), along(k)))
    };
    let values = (0..SIZE * SIZE * SIZE).map(cell).collect();
    let grid = Grid::new([SIZE; 3], 1, values)?;
    vol::write(path, &VolFile { grid, bounds: [Vec3::ZERO, Vec3::splat(1.0)] })?;
    Ok(())
}

#[cfg(not(feature = "vol"))]
fn main() {
    eprintln!("writing .vol files needs --features vol");
    std::process::exit(2);
}
