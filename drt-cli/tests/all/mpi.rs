//! Fits among the ranks of an MPI run. Needs Open MPI:
//!
//! ```sh
//! sudo apt-get install openmpi-bin libopenmpi-dev libclang-dev
//! cargo test --release -p drt-cli --features mpi --test all -- --ignored mpi:: --nocapture
//! ```

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective" id="one"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="SIZE"/><integer name="height" value="SIZE"/></film></sensor>
  <sensor type="perspective" id="two"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="3 -3 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="SIZE"/><integer name="height" value="SIZE"/></film></sensor>
  <shape type="rectangle"><bsdf type="diffuse" id="gray"><rgb name="reflectance" value="0.5"/></bsdf></shape>
  <shape type="cube" id="cube"><transform name="to_world"><scale value="0.3"/><translate z="0.5"/></transform>
    <bsdf type="diffuse"/></shape>
  <emitter type="point" id="lamp"><point name="position" value="1 -1 2"/></emitter>
</scene>"#;

/// A fit to one view or both.
fn folder(size: u32, spp: u32, views: usize, iterations: u32) -> Folder {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE.replace("SIZE", &size.to_string()));
    let targets = ["\"one.exr\"", "\"two.exr\""][..views].join(", ");
    folder.file(
        "job.toml",
        format!(
            "scene = \"scene.xml\"\n[estimator]\nspp = {spp}\n\
             [[parameter]]\nname = \"x\"\n[[parameter.effect]]\ntarget = \"cube\"\ntranslate = [1.0, 0.0, 0.0]\n\
             [[parameter]]\nname = \"gray\"\n[[parameter.effect]]\ntarget = \"gray\"\n\
             property = \"reflectance\"\nadd = [1.0, 1.0, 1.0]\n\
             [optimize]\ntargets = [{targets}]\nsensors = [{}]\ncheckpoint = \"run\"\ncheckpoint_every = 1\n\
             optimizer = {{ kind = \"adam\", learning_rate = 0.02, iterations = {iterations} }}\n",
            ["\"one\"", "\"two\""][..views].join(", ")
        ),
    );
    for sensor in ["one", "two"] {
        let set = "--set parameter.x.value=0.2 --set parameter.gray.value=0.1";
        let line =
            format!("render job.toml --sensor {sensor} --spp 32 --quiet {set} -o {sensor}.exr");
        expect(&folder.run(&line), 0, &[]);
    }
    folder
}

fn mpirun(folder: &Folder, ranks: u32, rest: &str) -> Command {
    let mut command = Command::new("mpirun");
    command.current_dir(folder.path()).env("OMPI_MCA_rmaps_base_oversubscribe", "1");
    command.args(["--allow-run-as-root", "--bind-to", "none", "-n", &ranks.to_string()]);
    command.arg(env!("CARGO_BIN_EXE_drt")).args([
        "optimize",
        "job.toml",
        "--threads",
        "1",
        "--quiet",
    ]);
    command.args(rest.split_whitespace()).stdout(Stdio::null());
    command
}

fn tables(folder: &Folder) -> [String; 2] {
    ["params.csv", "loss.csv"].map(|name| {
        std::fs::read_to_string(folder.path().join("run").join(name)).unwrap_or_default()
    })
}

/// The same tables from one process, and from any number of ranks.
#[test]
#[ignore = "needs mpirun"]
fn any_number_of_ranks_makes_the_same_fit() {
    for views in [1, 2] {
        let folder = folder(16, 16, views, 4);
        expect(&folder.run("optimize job.toml --quiet --threads 2"), 0, &[]);
        let alone = tables(&folder);
        assert_eq!(alone[0].lines().count(), 6);
        for ranks in [1, 2, 3, 4, 7] {
            let out = mpirun(&folder, ranks, "--restart").output().unwrap();
            expect(&out, 0, &[]);
            assert_eq!(tables(&folder), alone, "{views} views, {ranks} ranks");
        }
    }
}

/// One rank dies: all end, what is stored is whole, and another number of ranks goes on to the same bits.
#[test]
#[ignore = "needs mpirun"]
fn a_fit_goes_on_after_a_rank_has_died() {
    let folder = folder(32, 256, 1, 12);
    expect(&mpirun(&folder, 1, "").output().unwrap(), 0, &[]);
    let whole = tables(&folder);
    std::fs::remove_dir_all(folder.path().join("run")).unwrap();
    let mut steps = Vec::new();
    for ranks in [4, 2, 3] {
        let child = mpirun(&folder, ranks, "").stderr(Stdio::piped()).spawn().unwrap();
        // The last of its ranks is killed as soon as there is something new to go on from.
        let begun = Instant::now();
        let known = tables(&folder)[0].lines().count();
        while tables(&folder)[0].lines().count() < known + 2 && begun.elapsed().as_secs() < 120 {
            std::thread::sleep(Duration::from_millis(5));
        }
        let id = child.id();
        let children = Command::new("pgrep").args(["-P", &id.to_string()]).output().unwrap();
        let text = String::from_utf8_lossy(&children.stdout).into_owned();
        if let Some(victim) = text.split_whitespace().last() {
            Command::new("kill").args(["-KILL", victim]).status().unwrap();
        }
        let out = child.wait_with_output().unwrap();
        assert_ne!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
        steps.push(tables(&folder)[0].lines().count());
    }
    println!("rows of params.csv after each death: {steps:?}");
    expect(&mpirun(&folder, 2, "").output().unwrap(), 0, &[]);
    assert_eq!(tables(&folder), whole);
}

/// What one rank cannot use ends all, and is told once.
#[test]
#[ignore = "needs mpirun"]
fn mistakes_are_told_once() {
    let folder = folder(16, 16, 1, 2);
    folder.file("one.exr", "not an image");
    let out = mpirun(&folder, 3, "").output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(text.matches("drt: error: ").count(), 1, "{text}");
    assert!(text.contains("one.exr"), "{text}");
}

/// Twice the ranks, half the time, as far as there are cores.
#[test]
#[ignore = "needs mpirun and two idle cores; a minute"]
fn scaling() {
    for (views, size, spp) in [(1, 64, 256), (2, 64, 128)] {
        let folder = folder(size, spp, views, 6);
        let mut seconds = Vec::new();
        for ranks in [1, 2, 1, 2] {
            let begun = Instant::now();
            expect(&mpirun(&folder, ranks, "--restart").output().unwrap(), 0, &[]);
            seconds.push(begun.elapsed().as_secs_f64());
        }
        let [one, two] = [0, 1].map(|k: usize| f64::min(seconds[k], seconds[k + 2]));
        println!("{views} views: {seconds:.2?}; efficiency at 2 ranks {:.3}", one / (2.0 * two));
    }
}
