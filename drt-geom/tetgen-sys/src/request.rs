use std::io;
use std::path::PathBuf;
use std::time::Duration;

use crate::worker;

/// Most of anything: the library counts in `int`, and numbers a few more things than it is given.
const MOST: usize = i32::MAX as usize / 8;

/// What the library made.
#[derive(Clone, Debug, PartialEq)]
pub struct Tetrahedra {
    /// Vertex positions: first the points that were given, in their order, then those it added.
    pub points: Vec<[f64; 3]>,
    /// Vertex indices of each tetrahedron.
    pub tets: Vec<[u32; 4]>,
}

/// Why there are no tetrahedra.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A coordinate is NaN or infinite.
    #[error("point {point} (from 0) has a coordinate that is not a finite number")]
    NotFinite {
        /// Which point.
        point: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("triangle {triangle} (from 0) names point {index}, but there are only {count}")]
    IndexOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// The index it names.
        index: u32,
        /// How many points there are.
        count: usize,
    },
    /// More points or triangles than the library can count.
    #[error("{count} {what} are too many for TetGen, which takes up to {MOST}")]
    TooMany {
        /// Points or triangles.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// The directory for the worker, the request and the answer cannot be used.
    #[error(
        "the temporary directory {} cannot be used: {source}; TMPDIR names another",
        path.display()
    )]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The worker does not start.
    #[error(
        "TetGen's worker {} does not start: {source}; TMPDIR must name a directory from which \
         programs may be run",
        path.display()
    )]
    Start {
        /// The worker.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The library gave up.
    #[error("TetGen gave up: {reason} (its code {code})")]
    Refused {
        /// The library's error code.
        code: i32,
        /// What it stands for.
        reason: &'static str,
    },
    /// The worker ended early: a crash in the library, most often.
    #[error("TetGen's worker ended without an answer: {how}")]
    Ended {
        /// Exit code or signal.
        how: String,
    },
    /// The time was up, and the worker was ended.
    #[error("TetGen was not done within {limit:?}, and was stopped")]
    TimedOut {
        /// The time it had.
        limit: Duration,
    },
}

/// Tetrahedra that fill the convex hull of `points` and have every one of `triangles` among their
/// faces, without any point added on these.
///
/// Triangles must enclose everything, as those of a box do, or what lies outside is missing. Points
/// must be distinct, and triangles may only meet in common edges and corners. For input that is not
/// so, the library mostly, but not always, gives up.
///
/// Takes about two seconds for 70 000 triangles. May be called from any number of threads, each
/// with a worker of its own.
///
/// # Errors
/// When the input is not finite, names points that do not exist, or is too large; when the worker
/// cannot run; when the library gives up, crashes, or takes longer than `limit`.
pub fn tetrahedralize(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    limit: Duration,
) -> Result<Tetrahedra, Error> {
    for (what, count) in [("points", points.len()), ("triangles", triangles.len())] {
        if count > MOST {
            return Err(Error::TooMany { what, count });
        }
    }
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    if let Some(point) = points.iter().position(|p| !finite(p)) {
        return Err(Error::NotFinite { point });
    }
    let count = points.len();
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err(Error::IndexOutOfRange { triangle, index, count });
        }
    }
    let answer = worker::run(&request(points, triangles, limit), limit)?;
    read(&answer).ok_or_else(|| Error::Ended { how: "the answer is incomplete".into() })
}

fn request(points: &[[f64; 3]], triangles: &[[u32; 3]], limit: Duration) -> Vec<u8> {
    // The worker's own clock is a second one, for when nobody is left to stop it.
    let seconds = limit.as_secs().clamp(1, 1 << 30) + 1;
    let mut bytes = Vec::with_capacity(24 * (points.len() + 1) + 12 * triangles.len());
    for word in [points.len() as u64, triangles.len() as u64, seconds] {
        bytes.extend(word.to_ne_bytes());
    }
    bytes.extend(points.iter().flatten().flat_map(|x| x.to_ne_bytes()));
    bytes.extend(triangles.iter().flatten().flat_map(|i| i.to_ne_bytes()));
    bytes
}

/// The answer, when it is all there and makes sense.
fn read(bytes: &[u8]) -> Option<Tetrahedra> {
    let (header, rest) = bytes.split_at_checked(16)?;
    let count = |at: usize| {
        let word = header[at..at + 8].try_into().ok()?;
        usize::try_from(u64::from_ne_bytes(word)).ok()
    };
    let (points, tets) = (count(0)?, count(8)?);
    let split = points.checked_mul(24)?;
    if split.checked_add(tets.checked_mul(16)?)? != rest.len() {
        return None;
    }
    let (position_bytes, tet_bytes) = rest.split_at(split);
    let positions = position_bytes.chunks_exact(24).map(|p| words(p).map(f64::from_ne_bytes));
    let corners = tet_bytes.chunks_exact(16).map(|t| words(t).map(u32::from_ne_bytes));
    let answer = Tetrahedra { points: positions.collect(), tets: corners.collect() };
    let in_range = answer.tets.iter().flatten().all(|&i| (i as usize) < points);
    in_range.then_some(answer)
}

/// The first `N` words of `W` bytes each.
fn words<const W: usize, const N: usize>(bytes: &[u8]) -> [[u8; W]; N] {
    core::array::from_fn(|i| core::array::from_fn(|k| bytes[i * W + k]))
}
