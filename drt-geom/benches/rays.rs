//! Rays per second and build times, in ratios of one run.
//!
//! `cargo bench -p drt-geom --features obj --bench rays -- [MESH.obj] [--peer PROGRAM] [--only NAME]`
//!
//! Without a mesh, a bumpy sphere of 82 000 triangles. Contenders take turns on the same short
//! batches of rays, and each row gives the medians over the batches, so that what else the machine
//! does meanwhile weighs little. The references are the tree by our own builder, the portable walk, and
//! a peer if there is one: a program that is given the paths of two files, the triangles (a `u64` count, then nine `f64`
//! each) and the rays (a count, then origin, direction and end), and answers each line
//! `closest|any FIRST COUNT` with the seconds these rays took and how many of them hit something.

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use drt_geom::{BvhBuilder, Hit, Mesh, Ray, Skip, TriangleBvh, procedural};
use drt_math::{Rng, Vec3, vec3};

/// Rays of a batch: less than a millisecond, so that most batches are not interrupted.
const BATCH: usize = 1_000;
const BATCHES: usize = 400;
const BUILDS: usize = 15;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse()?;
    let triangles = mesh(options.mesh.as_deref())?.soup();
    let bvh = TriangleBvh::build(&triangles)?;
    let binned = TriangleBvh::build_by(BvhBuilder::Binned, &triangles)?;
    let others = [&binned, &bvh.clone().portable()];
    build_times(&triangles)?;
    println!("rays                  Mrays/s  to binned  to portable   to peer   hits");
    for (name, rays) in ray_sets(&bvh) {
        if options.only.as_ref().is_some_and(|only| !name.contains(only.as_str())) {
            continue;
        }
        let mut peer = match &options.peer {
            Some(program) => Some(Peer::start(program, &triangles, &rays)?),
            None => None,
        };
        for query in [Query::Closest, Query::Any, Query::Crossings] {
            let row = measure(query, &rays, &bvh, others, peer.as_mut())?;
            println!("{name:10} {:9} {row}", query.name());
        }
    }
    nearest(&bvh, others);
    Ok(())
}

fn build_times(triangles: &[[Vec3; 3]]) -> Result<(), Box<dyn Error>> {
    let timed = |builder| {
        let start = Instant::now();
        black_box(TriangleBvh::build_by(builder, triangles)?);
        Ok::<_, Box<dyn Error>>(start.elapsed().as_secs_f64())
    };
    let (mut own, mut to_binned) = (vec![], vec![]);
    for _ in 0..BUILDS {
        let seconds = timed(BvhBuilder::default())?;
        own.push(seconds * 1e3);
        to_binned.push(timed(BvhBuilder::Binned)? / seconds);
    }
    let (count, own, to_binned) = (triangles.len(), median(own), median(to_binned));
    println!("{count} triangles, built in {own:.1} ms, to binned {to_binned:.3}");
    Ok(())
}

#[derive(Default)]
struct Options {
    mesh: Option<String>,
    peer: Option<String>,
    only: Option<String>,
}

impl Options {
    fn parse() -> Result<Self, Box<dyn Error>> {
        let mut options = Self::default();
        // Cargo adds --bench.
        let mut words = std::env::args().skip(1).filter(|w| w != "--bench");
        while let Some(word) = words.next() {
            match word.as_str() {
                "--peer" => options.peer = Some(words.next().ok_or("--peer names a program")?),
                "--only" => options.only = Some(words.next().ok_or("--only names rays")?),
                _ => options.mesh = Some(word),
            }
        }
        Ok(options)
    }
}

fn mesh(path: Option<&str>) -> Result<Mesh, Box<dyn Error>> {
    match path {
        None => Ok(procedural::bumpy_sphere(6, 0.2, 6.0)),
        #[cfg(feature = "obj")]
        Some(path) => Ok(drt_geom::read_obj(path)?),
        #[cfg(not(feature = "obj"))]
        Some(path) => Err(format!("{path}: build with --features obj").into()),
    }
}

/// Rays in the scene's box: from a camera row by row; from anywhere to anywhere; between two points.
fn ray_sets(bvh: &TriangleBvh) -> [(&'static str, Vec<Ray>); 3] {
    let bounds = bvh.bounds();
    let extent = bounds.extent();
    let mut rng = Rng::new(1, 0, 0);
    let mut unit = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64());
    let mut point = || {
        let u = unit();
        bounds.min + vec3(u.x * extent.x, u.y * extent.y, u.z * extent.z)
    };
    let count = BATCH * BATCHES;
    let side = (count as f64).sqrt() as usize;
    let eye = bounds.center() + vec3(0.3, 0.2, 1.0) * (2.0 * extent.max_abs());
    let coherent = (0..count).map(|i| {
        let [x, y] = [i % side, i / side].map(|k| k as f64 / side as f64 - 0.5);
        let target = bounds.center() + vec3(x * extent.x, y * extent.y, 0.0);
        Ray::new(eye, (target - eye).normalize())
    });
    let coherent = coherent.collect();
    let incoherent = (0..count)
        .map(|_| {
            let (from, to) = (point(), point());
            Ray::new(from, (to - from).normalize())
        })
        .collect();
    let segments = (0..count).map(|_| Ray::segment(point(), point())).collect();
    [("coherent", coherent), ("incoherent", incoherent), ("segments", segments)]
}

#[derive(Clone, Copy)]
enum Query {
    Closest,
    Any,
    Crossings,
}

impl Query {
    const fn name(self) -> &'static str {
        match self {
            Self::Closest => "closest",
            Self::Any => "any",
            Self::Crossings => "crossings",
        }
    }

    /// How many rays hit something.
    fn run(self, bvh: &TriangleBvh, rays: &[Ray], hits: &mut Vec<Hit>) -> usize {
        let nothing = Skip::NOTHING;
        let count = |hit: &mut dyn FnMut(&Ray) -> bool| rays.iter().filter(|r| hit(r)).count();
        match self {
            Self::Closest => count(&mut |r| black_box(bvh.closest(r, nothing)).is_some()),
            Self::Any => count(&mut |r| bvh.any(r, nothing, |_| true)),
            Self::Crossings => count(&mut |r| {
                bvh.crossings(r, nothing, |_| false, hits);
                !hits.is_empty()
            }),
        }
    }
}

fn measure(
    query: Query,
    rays: &[Ray],
    bvh: &TriangleBvh,
    others: [&TriangleBvh; 2],
    mut peer: Option<&mut Peer>,
) -> Result<String, Box<dyn Error>> {
    let mut hits = Vec::new();
    let mut timed = |bvh: &TriangleBvh, batch: &[Ray]| {
        let start = Instant::now();
        let hit = query.run(bvh, batch, &mut hits);
        (start.elapsed().as_secs_f64(), hit)
    };
    let (mut own, mut to_others, mut to_peer, mut found) = (vec![], [vec![], vec![]], vec![], 0);
    for (i, batch) in rays.chunks(BATCH).enumerate() {
        let (seconds, hit) = timed(bvh, batch);
        own.push(batch.len() as f64 / seconds * 1e-6);
        for (ratios, other) in to_others.iter_mut().zip(others) {
            ratios.push(timed(other, batch).0 / seconds);
        }
        found += hit;
        if let Some(peer) = peer.as_mut().filter(|_| !matches!(query, Query::Crossings)) {
            to_peer.push(peer.seconds(query, i * BATCH, batch.len())? / seconds);
        }
    }
    let ratio = |r: Vec<f64>| if r.is_empty() { "-".into() } else { format!("{:.3}", median(r)) };
    let hit_rate = found as f64 / rays.len() as f64;
    let ([to_binned, to_portable], to_peer) = (to_others.map(ratio), ratio(to_peer));
    let own = median(own);
    Ok(format!("{own:8.2} {to_binned:>10} {to_portable:>12} {to_peer:>9}   {hit_rate:.3}"))
}

fn nearest(bvh: &TriangleBvh, others: [&TriangleBvh; 2]) {
    let bounds = bvh.bounds();
    let mut rng = Rng::new(2, 0, 0);
    let (mut own, mut to_others) = (vec![], [vec![], vec![]]);
    for _ in 0..BATCHES {
        let point = |_| {
            let u = vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0);
            bounds.center() + u * bounds.extent().max_abs()
        };
        let points: Vec<_> = (0..BATCH / 8).map(point).collect();
        let timed = |bvh: &TriangleBvh| {
            let start = Instant::now();
            for p in &points {
                black_box(bvh.closest_point(*p));
            }
            start.elapsed().as_secs_f64()
        };
        let seconds = timed(bvh);
        own.push(points.len() as f64 / seconds * 1e-6);
        for (ratios, other) in to_others.iter_mut().zip(others) {
            ratios.push(timed(other) / seconds);
        }
    }
    let (own, [to_binned, to_portable]) = (median(own), to_others.map(median));
    println!("points     nearest   {own:8.2} {to_binned:10.3} {to_portable:12.3}");
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Another program on the same rays.
struct Peer {
    child: Child,
    ask: ChildStdin,
    answer: BufReader<ChildStdout>,
    files: [std::path::PathBuf; 2],
}

impl Peer {
    fn start(program: &str, triangles: &[[Vec3; 3]], rays: &[Ray]) -> Result<Self, Box<dyn Error>> {
        let files = ["triangles", "rays"]
            .map(|kind| std::env::temp_dir().join(format!("drt-{kind}-{}", std::process::id())));
        let corners = triangles.iter().flatten().flat_map(|v| v.to_array());
        write_numbers(&files[0], triangles.len(), corners)?;
        let ray =
            |r: &Ray| [r.origin.to_array(), r.dir.to_array()].concat().into_iter().chain([r.t_max]);
        write_numbers(&files[1], rays.len(), rays.iter().flat_map(ray))?;
        let mut child = Command::new(program)
            .args(&files)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{program}: {e}"))?;
        let ask = child.stdin.take().ok_or("no way to ask the peer")?;
        let answer = BufReader::new(child.stdout.take().ok_or("no way to hear the peer")?);
        Ok(Self { child, ask, answer, files })
    }

    fn seconds(&mut self, query: Query, first: usize, count: usize) -> Result<f64, Box<dyn Error>> {
        writeln!(self.ask, "{} {first} {count}", query.name())?;
        let mut line = String::new();
        self.answer.read_line(&mut line)?;
        let seconds = line.split_whitespace().next().ok_or("the peer has stopped")?;
        Ok(seconds.parse()?)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // A peer that is gone already is as good, and so are files that are.
        let _ = self.child.kill();
        let _ = self.child.wait();
        for file in &self.files {
            let _ = std::fs::remove_file(file);
        }
    }
}

fn write_numbers(
    path: &Path,
    count: usize,
    numbers: impl Iterator<Item = f64>,
) -> std::io::Result<()> {
    let mut bytes = (count as u64).to_le_bytes().to_vec();
    bytes.extend(numbers.flat_map(f64::to_le_bytes));
    std::fs::write(path, bytes)
}
