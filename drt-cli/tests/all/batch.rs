//! `drt batch`: many jobs, some of them broken, and kills at any time.

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <default name="rho" value="0.5"/>
  <sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
  <shape type="rectangle"><bsdf type="diffuse" id="gray"><rgb name="reflectance" value="$rho"/></bsdf></shape>
  <emitter type="point" id="lamp"><point name="position" value="1 -1 2"/></emitter>
</scene>"#;

fn job(value: f64, scene: &str) -> String {
    format!(
        "scene = \"{scene}\"\n[estimator]\nspp = 4\n[[parameter]]\nname = \"x\"\nvalue = {value}\n\
         [[parameter.effect]]\ntarget = \"lamp\"\ntranslate = [1.0, 0.0, 0.0]\n"
    )
}

/// Jobs `0.toml` … on two scenes, of which some are broken; returns the names of those.
fn jobs(folder: &Folder, count: usize, broken: &[usize]) -> Vec<String> {
    folder.file("a.xml", SCENE);
    folder.file("b.xml", SCENE.replace("50", "40"));
    for i in 0..count {
        let scene = ["a.xml", "b.xml"][i % 2];
        let text = job(i as f64 / count as f64, scene);
        let text = if broken.contains(&i) { text.replace("lamp", "lmap") } else { text };
        folder.file(&format!("{i}.toml"), text);
    }
    (0..count).map(|i| format!("{i}.toml")).collect()
}

/// The events of the log, as (event, job), lines that were torn left out.
fn events(folder: &Folder) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(folder.path().join("out/batch.jsonl")).unwrap();
    let event = |line: &str| {
        let v: serde_json::Value = serde_json::from_str(line).ok()?;
        Some((v["event"].as_str()?.into(), v["job"].as_str()?.into()))
    };
    text.lines().filter_map(event).collect()
}

fn count(events: &[(String, String)], event: &str) -> usize {
    events.iter().filter(|(e, _)| e == event).count()
}

#[test]
fn broken_jobs_stop_no_others_and_finished_ones_are_skipped() {
    let folder = Folder::new();
    let names = jobs(&folder, 6, &[1, 4]);
    let line = format!("batch {} -o out --previews", names.join(" "));
    let out = folder.run(&line);
    let summary = "4 finished, 0 were finished before, 2 failed";
    expect(&out, 1, &["error: 1.toml:7", "error: 4.toml:7", "lmap", summary]);
    for i in [0, 2, 3, 5] {
        assert_eq!(folder.json(&format!("out/{i}.json"))["command"], "grad");
        assert!(folder.exr(&format!("out/{i}.exr")).layers.contains_key("d_x"));
        assert!(folder.path().join(format!("out/{i}.png")).is_file());
    }
    assert!(!folder.path().join("out/1.exr").exists());
    // Shared preparations change no bit.
    expect(&folder.run("grad 5.toml --quiet -o alone.exr"), 0, &[]);
    assert_eq!(folder.exr("alone.exr").layers, folder.exr("out/5.exr").layers);

    // One is mended, one changes, of one a result is missing, and of one the scene has changed.
    folder.file("1.toml", job(0.3, "b.xml"));
    folder.file("3.toml", job(0.7, "b.xml"));
    std::fs::remove_file(folder.path().join("out/0.json")).unwrap();
    expect(&folder.run(&line), 1, &["3 finished, 2 were finished before, 1 failed"]);
    folder.file("b.xml", SCENE.replace("50", "41"));
    expect(&folder.run(&line), 1, &["3 finished, 2 were finished before, 1 failed"]);
    let missing = folder.run("batch 7.toml -o other");
    expect(&missing, 1, &["error: 7.toml: cannot read this file"]);
    let events = events(&folder);
    assert_eq!((count(&events, "finished"), count(&events, "failed")), (10, 4));
}

#[test]
fn lists_sweep() {
    let folder = Folder::new();
    jobs(&folder, 1, &[]);
    folder.file(
        "list",
        "# the lamp, and the floor\n0.toml --set parameter.x.value=0.1 -o out/x1.exr\n\
         0.toml --set parameter.x.value=0.2 -o out/x2.exr\na.xml -D rho=0 --spp 2\n",
    );
    expect(&folder.run("batch --list list -o out --seed 3"), 0, &["3 finished"]);
    let digest = folder.json("out/a.json");
    assert_eq!((&digest["seed"], &digest["spp"]), (&3.into(), &2.into()));
    assert_ne!(folder.exr("out/x1.exr").layers[""], folder.exr("out/x2.exr").layers[""]);
    for (line, part) in [
        ("batch 0.toml 0.toml", "0.toml: ./0.exr is what 0.toml names, too"),
        ("batch --list none", "none: cannot read"),
        ("batch", "<INPUTS>"),
    ] {
        expect(&folder.run(line), 2, &[part]);
    }
}

#[cfg(unix)]
#[test]
#[ignore = "200 jobs; some ten seconds"]
fn killed_ten_times() {
    use std::time::{Duration, Instant};

    let folder = Folder::new();
    let broken = [3, 50, 99, 100, 198];
    let names = jobs(&folder, 200, &broken).join(" ");
    // Long enough to be hit.
    let line = |out: &str| format!("batch {names} -o {out} --quiet --spp 512");
    let begun = Instant::now();
    expect(&folder.run(&line("whole")), 1, &[]);
    let slice = begun.elapsed() / 14;
    let mut rng = drt_math::Rng::new(7, 0, 0);
    for _ in 0..10 {
        let mut child =
            folder.command(&line("out")).stderr(std::process::Stdio::null()).spawn().unwrap();
        std::thread::sleep(slice.mul_f64(0.5 + rng.next_f64()).max(Duration::from_millis(1)));
        // SIGKILL.
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let out = folder.run(&line("out"));
    let names: Vec<String> = broken.iter().map(|i| format!("error: {i}.toml: ")).collect();
    expect(&out, 1, &names.iter().map(String::as_str).collect::<Vec<_>>());
    let mut results = 0;
    for i in (0..200).filter(|i| !broken.contains(i)) {
        let [a, b] = ["whole", "out"].map(|o| folder.exr(&format!("{o}/{i}.exr")));
        assert_eq!(a.layers, b.layers, "{i}");
        results += 1;
    }
    let events = events(&folder);
    let started = count(&events, "started");
    println!("{results} results; {started} jobs started in 11 runs; {slice:?} a run on average");
    assert_eq!(results, 195);
    // What was in flight was begun again, and nothing else.
    assert!((195..=205).contains(&started), "{started}");
    for i in 0..200 {
        let of = |event: &str| {
            events.iter().filter(|(e, j)| e == event && *j == format!("{i}.toml")).count()
        };
        assert!(of("finished") <= 1, "{i}");
    }
    let left = std::fs::read_dir(folder.path().join("out")).unwrap();
    let drafts =
        left.flatten().filter(|e| e.file_name().to_string_lossy().ends_with(".tmp")).count();
    assert_eq!(drafts, 0);
}
