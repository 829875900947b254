//! The `drt` program from outside: exit codes, files and messages.

use std::process::{Command, Stdio};

use crate::common::{Folder, expect, gray_and_lamp};

const SCENE: &str = r#"<scene version="3.0.0">
  <default name="rho" value="0.5"/>
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective" id="cam"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/>
      <rfilter type="tent"/></film>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
  <shape type="rectangle" id="floor"><bsdf type="diffuse" id="gray">
    <rgb name="reflectance" value="$rho"/></bsdf></shape>
  <emitter type="point" id="lamp"><point name="position" value="1 -1 2"/></emitter>
</scene>"#;

const JOB: &str = gray_and_lamp!("64", "value = 0.1\n");

/// A folder with a scene and a job.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    folder
}

fn means(image: &serde_json::Value) -> Vec<f64> {
    image["mean"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn render_writes_everything_asked_for() {
    let folder = folder();
    let out = folder.run("render scene.xml -o a.exr --digest a.json --preview a.png");
    expect(&out, 0, &["16x8, 4 spp"]);
    assert!(out.stdout.is_empty());
    let digest = folder.json("a.json");
    assert_eq!((&digest["spp"], &digest["complete"]), (&4.into(), &true.into()));
    assert_eq!(digest["derivatives"], serde_json::json!({}));
    assert!(means(&digest["image"])[0] > 0.0);
    assert_eq!(folder.exr("a.exr").layers.len(), 2);
    assert!(std::fs::read(folder.path().join("a.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn options_reach_scene_and_job() {
    let folder = folder();
    let out = folder.run(
        "render scene.xml --digest - --quiet --spp 8 --size 9x5 --seed 3 --threads 1 --max-depth 2 \
         --sensor cam -D rho=0",
    );
    expect(&out, 0, &[]);
    assert!(out.stderr.is_empty());
    let digest: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    for (key, value) in [("spp", 8), ("width", 9), ("height", 5), ("seed", 3), ("threads", 1)] {
        assert_eq!(digest[key], value, "{key}");
    }
    assert_eq!(means(&digest["image"]), [0.0; 3]);
    let set = "--set estimator.spp=2 --set parameter.gray.value=0.25";
    let out = folder.run(&format!("render job.toml --quiet --digest - {set}"));
    let brighter: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(brighter["spp"], 2);
}

#[test]
fn same_seed_same_pixels_for_any_number_of_threads() {
    let folder = folder();
    for threads in [1, 3] {
        let line = format!("grad job.toml --quiet --terms --threads {threads} -o {threads}.exr");
        expect(&folder.run(&line), 0, &[]);
    }
    let (one, three) = (folder.exr("1.exr"), folder.exr("3.exr"));
    assert_eq!(one.layers, three.layers);
    for layer in ["", "stderr", "d_gray", "d_gray_stderr", "d_lamp-x", "d_gray.interior"] {
        assert!(one.layers.contains_key(layer), "{layer}");
    }
    assert!(one.attributes["drt_job_text"].contains("lamp-x"));
}

#[test]
fn gradients_pass_their_check() {
    let folder = folder();
    let out = folder.run("check job.toml --spp 512 --digest c.json -o c.exr");
    expect(&out, 0, &[]);
    let table = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(table.contains("relative noise") && table.contains("agrees"), "{table}");
    assert_eq!(folder.json("c.json")["checks"].as_array().unwrap().len(), 2);
    assert!(folder.exr("c.exr").layers.contains_key("fd_lamp-x"));
}

/// Where half of a derivative could be missing, nothing is said to agree.
#[test]
fn noisy_checks_tell_nothing() {
    let folder = folder();
    let noisy = "check job.toml --quiet --spp 1 --size 64x32 --set estimator.step=1e-6";
    let out = folder.run(&format!("{noisy} --set estimator.kind=path-space --max-depth 2"));
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert!(said.contains("too noisy to tell") && said.contains("--spp"), "{said}");
}

#[test]
fn info_lists_and_plans() {
    let folder = folder();
    let out = folder.run("info job.toml");
    expect(&out, 0, &[]);
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    for part in ["floor", "gray", "lamp", "cam", "16x8", "translate", "plan", "path record: yes"] {
        assert!(text.contains(part), "expected `{part}` in: {text}");
    }
    expect(&folder.run("info scene.xml"), 0, &[]);
}

#[test]
fn unusable_input_exits_with_2_and_writes_nothing() {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("bad.xml", &SCENE.replace("type=\"rectangle\"", "type=\"torus\""));
    write("bad.toml", &JOB.replace("spp", "ssp"));
    write("alone.xml", "<scene version=\"3.0.0\"/>");
    write("effect.toml", &JOB.replace("reflectance", "colour"));
    for (line, part) in [
        ("render bad.xml", "drt: error: bad.xml:9: <shape type=\"torus\""),
        ("grad bad.toml", "drt: error: bad.toml:3:1: unknown field `ssp`"),
        ("render none.xml", "none.xml: cannot read"),
        ("render alone.xml", "alone.xml: the scene has no <sensor>"),
        ("grad scene.xml", "derivatives need a job"),
        ("grad effect.toml", "effect.toml:4"),
        ("render scene.xml --set estimator.spp=3", "--set estimator.spp"),
        ("render scene.xml -D speed=3", "-D speed"),
        ("render scene.xml --size 0x3", "640x480"),
        ("render scene.xml --spp 0", "--spp"),
        ("render scene.xml --seconds -1", "--seconds"),
        ("render scene.xml --sensor eye", "--sensor: "),
        ("render scene.xml --max-depth -2", "--max-depth: "),
        ("render scene.xml --colour", "--colour"),
        ("paint scene.xml", "paint"),
        ("grad job.toml --loss t.exr", "--digest does not go with a gradient"),
        ("optimize job.toml", "it has no [optimize]"),
        ("bench", "<INPUTS>"),
    ] {
        let out = folder.run(&format!(
            "{line} {}",
            match line {
                "bench" => "",
                _ => "-o a.exr --digest a.json --preview a.png",
            }
        ));
        expect(&out, 2, &[part]);
        assert!(out.stdout.is_empty());
        for name in ["a.exr", "a.json", "a.png"] {
            assert!(!folder.path().join(name).exists(), "{line} wrote {name}");
        }
    }
    expect(&folder.run("--help"), 0, &[]);
    expect(&folder.run("--version"), 0, &[]);
}

#[test]
fn failures_while_writing_exit_with_3() {
    let folder = folder();
    expect(&folder.run("render scene.xml -o nowhere/a.exr"), 3, &["cannot write nowhere/a.exr"]);
    expect(&folder.run("render scene.xml --digest ."), 3, &["cannot write ."]);
}

#[test]
fn stop_rules() {
    let folder = folder();
    let out = folder.run("render scene.xml --quiet --target-error 0.01 --digest a.json");
    expect(&out, 0, &[]);
    let [coarse, fine] = [0.01, 0.003].map(|target| {
        let line = format!("render scene.xml --quiet --target-error {target} --digest a.json");
        expect(&folder.run(&line), 0, &[]);
        folder.json("a.json")["spp"].as_u64().unwrap()
    });
    assert!(fine > coarse, "{fine} {coarse}");
    let capped = folder.run("render scene.xml --target-error 1e-9 --spp 40 --digest a.json");
    expect(&capped, 0, &["above the target error of 0.00 %"]);
    assert_eq!(folder.json("a.json")["spp"], 40);
    let timed = folder.run("render scene.xml --quiet --seconds 0.3 --digest a.json");
    expect(&timed, 0, &[]);
    let digest = folder.json("a.json");
    assert!(digest["seconds"].as_f64().unwrap() < 3.0);
    assert!(digest["spp"].as_u64().unwrap() > 4);
}

/// Finite differences go on until they are known, not their image alone.
#[test]
fn stop_rules_of_differences() {
    let folder = folder();
    let set = "--set estimator.kind=\"finite-difference\" --quiet --digest a.json";
    let noise = |rules: &str| {
        expect(&folder.run(&format!("grad job.toml {set} {rules}")), 0, &[]);
        let digest = folder.json("a.json");
        let of = |value: &serde_json::Value| {
            let all = value.as_array().unwrap().iter().flat_map(|b| b.as_array().unwrap().clone());
            all.map(|v| v.as_f64().unwrap().powi(2)).sum::<f64>()
        };
        let layer = &digest["derivatives"]["lamp-x"]["blocks"];
        (of(&layer["stderr"]) / of(&layer["mean"])).sqrt()
    };
    let [coarse, fine] = [0.2, 0.05].map(|target| noise(&format!("--target-error {target}")));
    assert!(fine < 0.06 && coarse > fine, "{coarse} {fine}");
    // Time ends it first.
    let started = std::time::Instant::now();
    let timed = noise("--target-error 1e-9 --seconds 0.5");
    assert!(timed < 0.2 && started.elapsed().as_secs_f64() < 5.0, "{timed}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_finished() {
    let folder = folder();
    let mut command = folder.command("render scene.xml --seconds 600 --digest a.json -o a.exr");
    let child = command.stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let out = child.wait_with_output().unwrap();
    expect(&out, 130, &["incomplete"]);
    let digest = folder.json("a.json");
    assert_eq!(digest["complete"], false);
    assert!(digest["spp"].as_u64().unwrap() > 0);
    assert_eq!(folder.exr("a.exr").attributes["drt_complete"], "0");
}

#[test]
fn what_is_read_is_not_overwritten() {
    let folder = folder();
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    for (line, parts) in [
        ("render scene.xml -o scene.xml", &["-o: scene.xml is read"][..]),
        ("render scene.xml -o ./a.exr --digest a.exr", &["--digest: a.exr", "-o"]),
        ("grad job.toml --digest job.toml", &["--digest: job.toml is read"]),
        ("grad job.toml --preview ../NAME/scene.xml", &["--preview: ", "scene.xml is read"]),
        ("bench job.toml --csv scene.xml", &["--csv: scene.xml is read"]),
        ("preview scene.xml -o scene.xml", &["-o: scene.xml is read"]),
        ("merge scene.xml job.toml -o scene.xml", &["-o: scene.xml is read"]),
        ("batch job.toml -o . --list scene.xml", &["scene.xml"]),
    ] {
        let name = folder.path().file_name().unwrap().to_string_lossy().into_owned();
        let out = folder.run(&line.replace("NAME", &name));
        expect(&out, 2, parts);
        assert_eq!((text("scene.xml"), text("job.toml")), (SCENE.into(), JOB.into()), "{line}");
    }
    folder.file("list", "scene.xml -o job.toml\njob.toml\n");
    expect(
        &folder.run("batch --list list -o out"),
        2,
        &["job.toml is read by this command, and would be"],
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing is written");
}

#[cfg(unix)]
#[test]
fn links_and_pipes() {
    use std::os::unix::fs::symlink;

    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    symlink(at("scene.xml"), at("link.xml")).unwrap();
    expect(&folder.run("render link.xml -o scene.xml"), 2, &["-o: scene.xml is read"]);
    // A link that somebody planted is replaced, not followed.
    folder.file("theirs", "theirs");
    symlink(at("theirs"), at("a.exr")).unwrap();
    expect(&folder.run("render scene.xml -o a.exr"), 0, &[]);
    assert_eq!(std::fs::read_to_string(at("theirs")).unwrap(), "theirs");
    assert!(at("a.exr").symlink_metadata().unwrap().is_file());
    assert!(Command::new("mkfifo").arg(at("fifo")).status().unwrap().success());
    for line in [
        "info fifo",
        "info /dev/zero",
        "merge fifo",
        "preview fifo",
        "grad job.toml --loss fifo -o g.npy",
    ] {
        expect(&folder.run(line), 2, &["regular file"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn readers_that_go_and_disks_that_are_full() {
    let folder = folder();
    folder.file("a.json", "");
    for line in
        ["info job.toml", "check job.toml --spp 1 --quiet", "man", "completions bash", "--help"]
    {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let out = folder.command(line).stdout(full).output().unwrap();
        expect(&out, 3, &["drt: error: cannot write to the standard output"]);
        // A pipe whose other end is closed.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let out = folder.command(line).stdout(writer).output().unwrap();
        assert!(matches!(out.status.code(), Some(0 | 1)), "{line}: {}", out.status);
        assert!(!String::from_utf8_lossy(&out.stderr).contains("panicked"));
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = folder.command("render scene.xml -o a.exr");
        assert_eq!(command.stderr(full).status().unwrap().code(), Some(0));
    }
}

#[cfg(unix)]
#[test]
fn signals_end_a_run_with_what_is_finished() {
    use std::time::{Duration, Instant};

    for (signal, line) in [
        ("TERM", "render scene.xml --quiet --spp 100000000 -o a.exr"),
        ("INT", "grad job.toml --quiet --spp 100000000 --threads 1 -o a.exr"),
    ] {
        let folder = folder();
        let mut child = folder.command(line).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        let asked = Instant::now();
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &id]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{line}");
        assert!(asked.elapsed() < Duration::from_secs(10), "{:?}", asked.elapsed());
        assert_eq!(folder.exr("a.exr").attributes["drt_complete"], "0");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn films_that_do_not_fit_into_memory() {
    let folder = folder();
    let mut shell = Command::new("sh");
    let drt = env!("CARGO_BIN_EXE_drt");
    let line =
        format!("ulimit -v 2000000; {drt} grad job.toml --size 8192x8192 --threads 1 -o a.exr");
    let out = shell.current_dir(folder.path()).args(["-c", &line]).output().unwrap();
    expect(&out, 2, &["the film of 8192x8192 pixels", "GB", "--size"]);
}

/// The digest goes into a pipe that is full, so that the signal comes while results are written.
#[cfg(unix)]
#[test]
fn what_is_being_written_when_a_signal_comes_is_written() {
    use std::io::{Read, Write};
    use std::time::Duration;

    let folder = folder();
    let (mut from, mut to) = std::io::pipe().unwrap();
    let stdout = to.try_clone().unwrap();
    let filler = std::thread::spawn(move || to.write_all(&[0; 1 << 20]));
    std::thread::sleep(Duration::from_millis(200));
    // The command holds an end of the pipe too, which it drops with the statement: only then does the pipe end.
    let line = "render scene.xml --quiet --preview a.png --digest - -o a.exr";
    let mut child = folder.command(line).stdout(stdout).spawn().unwrap();
    while !folder.path().join("a.png").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    // Work that does not look at signals gets less time than this.
    std::thread::sleep(Duration::from_millis(1200));
    assert!(child.try_wait().unwrap().is_none());
    let mut told = Vec::new();
    from.read_to_end(&mut told).unwrap();
    filler.join().unwrap().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(String::from_utf8_lossy(&told).contains("\"command\""));
    folder.exr("a.exr");
}
