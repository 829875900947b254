//! `drt optimize` from outside: it arrives, goes on after a crash to the same bits, and says plainly
//! why it cannot.

use std::path::Path;
use std::time::Duration;

use crate::common::{Folder, expect, gray_and_lamp};

const SCENE: &str = r#"<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective" id="cam"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
      <rfilter type="box"/></film></sensor>
  <sensor type="perspective" id="above"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0 0 5" target="0 0 0" up="0 1 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
      <rfilter type="box"/></film></sensor>
  <shape type="rectangle" id="floor"><bsdf type="diffuse" id="gray">
    <rgb name="reflectance" value="0.5"/></bsdf></shape>
  <emitter type="point" id="lamp"><point name="position" value="0.5 -0.5 1"/></emitter>
</scene>"#;

const JOB: &str = gray_and_lamp!("16", "");

const FIT: &str = r#"
[optimize]
targets = ["target.exr"]
loss = { pyramid-l2 = { levels = 10, weight = 4 } }
bounds = { gray = [-0.4, 0.4] }
checkpoint = "run"
checkpoint_every = 3
optimizer = { kind = "adam", learning_rate = { gray = 0.02, lamp-x = 0.05 }, iterations = 60, decay = "cosine" }
"#;

/// A folder with a scene, a job and its target at gray = 0.2 and lamp-x = -0.5.
fn folder(fit: &str) -> Folder {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", format!("{JOB}{fit}"));
    render(&folder, "-o target.exr");
    folder
}

fn render(folder: &Folder, options: &str) {
    let at = "--set parameter.gray.value=0.2 --set parameter.lamp-x.value=-0.5";
    let line = format!("render job.toml --quiet --spp 256 {at} {options}");
    expect(&folder.run(&line), 0, &[]);
}

fn text(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).unwrap()
}

/// The last row of the table of values.
fn result(folder: &Folder) -> Vec<f64> {
    let table = text(folder, "run/params.csv");
    let last = table.lines().last().unwrap();
    last.split(',').skip(1).map(|v| v.parse().unwrap()).collect()
}

#[test]
fn a_fit_arrives_and_tells_of_it() {
    let folder = folder(FIT);
    let out = folder.run("optimize job.toml -o end.exr --digest end.json");
    expect(&out, 0, &[]);
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(said.contains("gray = 0.") && said.contains(" ± "), "{said}");
    assert!(said.contains("a further step would change it by"), "{said}");
    let [gray, lamp] = result(&folder)[..] else { panic!() };
    assert!((gray - 0.2).abs() < 0.02 && (lamp + 0.5).abs() < 0.05, "{gray} {lamp}");
    let (values, losses) = (text(&folder, "run/params.csv"), text(&folder, "run/loss.csv"));
    assert!(values.starts_with("iteration,gray,lamp-x\n0,0.0,0.0\n1,"));
    assert!(losses.starts_with("iteration,loss\n0,"));
    assert_eq!((values.lines().count(), losses.lines().count()), (62, 62));
    assert_eq!(folder.json("end.json")["command"], "optimize");
    assert!(folder.exr("end.exr").layers.contains_key("d_lamp-x"));
    for name in ["initial", "target", "current", "difference", "derivative-000", "frame-00060"] {
        assert!(folder.path().join(format!("run/{name}.png")).is_file(), "{name}");
    }
    let page = text(&folder, "run/report.html");
    assert!(page.contains("<td>lamp-x</td>") && page.contains("data:image/png;base64,"));
    assert!(!page.contains("http://") && !page.contains("https://"), "it needs nothing else");
    // Once there, it stays there.
    let state = || (text(&folder, "run/params.csv"), folder.json("run/checkpoint.json"));
    let before = state();
    let again = folder.run("optimize job.toml");
    expect(&again, 0, &[]);
    let said = String::from_utf8_lossy(&again.stdout);
    assert!(said.contains("it was finished before"), "{said}");
    assert_eq!(before, state(), "times included");
    // What begins anew leaves nothing of what was.
    folder.file("run/frame-notes.png", "mine");
    expect(&folder.run("optimize job.toml --quiet --restart --iterations 7"), 0, &[]);
    let there = |name: &str| folder.path().join(format!("run/{name}.png")).is_file();
    assert!(there("frame-00007") && there("frame-notes") && !there("frame-00060"));
}

/// Both parameters in a tenth of Adam's iterations.
#[test]
fn gauss_newton_arrives_sooner() {
    let adam = r#"kind = "adam", learning_rate = { gray = 0.02, lamp-x = 0.05 }, iterations = 60, decay = "cosine""#;
    let newton = r#"kind = "gauss-newton", learning_rate = 0.3, memory = 0.4, iterations = 12"#;
    let fit = FIT.replace(adam, newton);
    assert_ne!(fit, FIT);
    let [whole, broken] = [(); 2].map(|()| folder(&fit));
    expect(&whole.run("optimize job.toml --quiet --threads 1"), 0, &[]);
    let [gray, lamp] = result(&whole)[..] else { panic!() };
    assert!((gray - 0.2).abs() < 0.02 && (lamp + 0.5).abs() < 0.05, "{gray} {lamp}");
    assert!(text(&whole, "run/report.html").contains("averages"));
    // What it remembers is stored to the bit.
    for n in [1, 2, 5, 12] {
        let line = format!("optimize job.toml --quiet --threads 2 --iterations {n}");
        expect(&broken.run(&line), 0, &[]);
    }
    assert_eq!(outcome(&whole), outcome(&broken));
    let l1 = fit.replace("{ pyramid-l2 = { levels = 10, weight = 4 } }", "\"l1\"");
    whole.file("job.toml", format!("{JOB}{l1}"));
    expect(
        &whole.run("optimize job.toml --restart"),
        2,
        &["`optimizer` \"gauss-newton\"", "\"l1\""],
    );
    whole.file("job.toml", format!("{JOB}{}", fit.replace("memory = 0.4", "memory = 2")));
    expect(&whole.run("optimize job.toml --restart"), 2, &["memory is 2; expected more than 0"]);
    whole.file("job.toml", format!("{JOB}{}", FIT.replace("decay =", "memory = 0.5, decay =")));
    expect(
        &whole.run("optimize job.toml --restart"),
        2,
        &["`memory` does not belong to this kind"],
    );
}

/// All that must not depend on where a run was stopped.
fn outcome(folder: &Folder) -> (String, String, serde_json::Value) {
    let state = folder.json("run/checkpoint.json")["optimizer"].clone();
    (text(folder, "run/params.csv"), text(folder, "run/loss.csv"), state)
}

#[test]
fn killed_at_any_moment_it_ends_in_the_same_bits() {
    let [whole, broken] = [(); 2].map(|()| folder(FIT));
    expect(&whole.run("optimize job.toml --quiet --threads 1"), 0, &[]);
    let refreshes = || {
        let page = std::fs::read_to_string(broken.path().join("run/report.html"));
        page.is_ok_and(|page| page.contains("http-equiv=\"refresh\""))
    };
    let (mut killed, mut random, mut refreshed) = (0, 12345_u32, false);
    for _ in 0..40 {
        let mut child = broken.command("optimize job.toml --quiet --threads 2").spawn().unwrap();
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        std::thread::sleep(Duration::from_millis(u64::from(40 + random % 300)));
        match child.try_wait().unwrap() {
            Some(status) => assert!(status.success()),
            None => {
                // SIGKILL: nothing can be done about it.
                child.kill().unwrap();
                killed += 1;
            }
        }
        child.wait().unwrap();
        refreshed |= refreshes();
        if killed == 10 {
            break;
        }
    }
    assert!(killed >= 2, "killed {killed} times");
    expect(&broken.run("optimize job.toml --quiet"), 0, &[]);
    assert_eq!(outcome(&whole), outcome(&broken));
    assert!(refreshed && !refreshes(), "the page is loaded anew until the run has ended");
    let left = std::fs::read_dir(broken.path().join("run")).unwrap();
    let drafts =
        left.filter(|f| f.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(drafts.count(), 0, "what a kill left behind is gone");
}

#[test]
fn a_run_can_stop_for_a_while_and_go_on_longer() {
    let [whole, broken] = [(); 2].map(|()| folder(&FIT.replace("\"cosine\"", "\"constant\"")));
    expect(&whole.run("optimize job.toml --quiet"), 0, &[]);
    expect(&broken.run("optimize job.toml --seconds 0.001"), 0, &[]);
    assert!(text(&broken, "run/params.csv").lines().count() < 62);
    expect(&broken.run("optimize job.toml --quiet --iterations 20"), 0, &[]);
    expect(&broken.run("optimize job.toml --quiet"), 0, &[]);
    assert_eq!(outcome(&whole), outcome(&broken));
    // Another problem does not go on from there.
    let other = "optimize job.toml --quiet --seed 7";
    expect(&broken.run(other), 2, &["checkpoint.json: it belongs to another problem"]);
    expect(&broken.run(&format!("{other} --restart")), 0, &[]);
    assert_ne!(outcome(&whole), outcome(&broken));
}

#[test]
fn several_sensors_masks_schedules_and_png() {
    let fit = r#"
[optimize]
targets = ["target.png", "above.exr"]
masks = ["mask.png", "ones.png"]
relative = 0.1
loss = "rmse"
log = []
spp = [[10, 16]]
reduce = [[0, 2], [20, 1]]
optimizer = { kind = "sgd", momentum = 0.5, learning_rate = 0.3, iterations = 40 }
checkpoint = "run"
"#;
    let folder = folder(fit);
    render(&folder, "-o target.png --set estimator.spp=4 --size 16x16");
    render(&folder, "-o above.exr --sensor above");
    for (name, size, black) in [("mask.png", 16, 10), ("ones.png", 8, 0)] {
        let pixels: Vec<u8> =
            (0..size * size).map(|i| if i % size < black { 0 } else { 255 }).collect();
        let file = std::fs::File::create(folder.path().join(name)).unwrap();
        let mut encoder = png::Encoder::new(file, size, size);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    }
    expect(&folder.run("optimize job.toml --quiet"), 0, &[]);
    assert!(folder.path().join("run/current-2.png").is_file());
    let losses = text(&folder, "run/loss.csv");
    assert_eq!(losses.lines().count(), 42);
}

/// The numbers of an NPY file.
fn array(folder: &Folder, name: &str) -> Vec<f64> {
    let bytes = std::fs::read(folder.path().join(name)).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00") && bytes[..start].ends_with(b"\n"));
    assert!(String::from_utf8_lossy(&bytes[..start]).contains("'<f8'"));
    bytes[start..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn gradients_by_target_and_by_adjoint_agree() {
    let folder = folder("");
    expect(&folder.run("grad job.toml --quiet --spp 512 --loss target.exr -o a.npy"), 0, &[]);
    let gradient = array(&folder, "a.npy");
    assert_eq!(gradient.len(), 2);
    // Of squares: twice the difference of images.
    expect(&folder.run("render job.toml --quiet --spp 512 -o now.exr --seed 9"), 0, &[]);
    let [now, target] = ["now.exr", "target.exr"].map(|f| folder.exr(f).layers[""].clone());
    let twice = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| f64::from(2.0 * (a[c] - b[c])));
    let adjoint: Vec<[f64; 3]> = now.iter().zip(&target).map(twice).collect();
    expect(&folder.run("grad job.toml --quiet --spp 512 -o d.exr"), 0, &[]);
    let layers = folder.exr("d.exr").layers;
    for (name, g) in ["d_gray", "d_lamp-x"].into_iter().zip(&gradient) {
        let pairs = layers[name].iter().zip(&adjoint);
        let product = pairs.map(|(d, a)| (0..3).map(|c| f64::from(d[c]) * a[c]).sum::<f64>());
        let expected = product.sum::<f64>();
        assert!((g - expected).abs() < 0.05 * expected.abs(), "{name}: {g} {expected}");
    }
    // An image of ones adds up every derivative.
    let ones = vec![255_u8; 16 * 16];
    let file = std::fs::File::create(folder.path().join("ones.png")).unwrap();
    let mut encoder = png::Encoder::new(file, 16, 16);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&ones).unwrap();
    expect(&folder.run("grad job.toml --quiet --spp 512 --adjoint ones.png -o b.npy"), 0, &[]);
    let sum = layers["d_gray"].iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    assert!((array(&folder, "b.npy")[0] - sum).abs() < 1e-4 * sum.abs());
    expect(&folder.run("grad job.toml --quiet --spp 512 --loss target.exr"), 0, &[]);
    assert_eq!(array(&folder, "job.npy"), gradient, "beside the job");
    let small = "grad job.toml --quiet --loss target.exr --size 8x8 -o c.npy";
    expect(&folder.run(small), 2, &["target.exr: it has 16x16 pixels"]);
}

/// A pose is a known part of the scene, a mask and `relative` are part of the loss, and views add up.
#[test]
fn gradients_are_those_of_all_views() {
    let folder = folder("");
    expect(&folder.run("render job.toml --quiet --spp 64 --sensor above -o above.exr"), 0, &[]);
    let gray = |values: &[u8]| image::GrayImage::from_raw(8, 8, values.to_vec()).unwrap();
    let half: Vec<u8> = (0..64).map(|i| if i % 8 < 4 { 255 } else { 0 }).collect();
    gray(&half).save(folder.path().join("half.png")).unwrap();
    let view = |target: &str, more: &str| format!("[[view]]\ntarget = \"{target}\"\n{more}\n");
    let moved = "[[view.effect]]\ntarget = \"lamp\"\ntranslate = [1.0, 0.0, 0.0]\namount = 0.3";
    let masked = "sensor = \"above\"\nmask = \"half.png\"";
    let group = "[[parameter_group]]\ntarget = \"floor\"\nvertices = \"all\"\n";
    let gradient = |groups: &str, plan: &str, options: &str| {
        folder.file("views.toml", format!("{JOB}{groups}[optimize]\nrelative = 0.5\n{plan}"));
        let line = format!("grad views.toml --quiet --spp 64 {options} -o g.npy");
        expect(&folder.run(&line), 0, &[]);
        array(&folder, "g.npy")
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * (a.abs() + b.abs());
    let posed = view("target.exr", moved) + &view("above.exr", &format!("{masked}\n{moved}"));
    let posed = gradient(group, &posed, "--loss");
    let both = view("target.exr", "") + &view("above.exr", masked);
    let there = gradient(group, &both, "--set parameter.lamp-x.value=0.3 --loss");
    assert!(posed.len() == 2 + 12 && posed.iter().zip(&there).all(|(a, b)| near(*a, *b)));
    let both = gradient("", &both, "--loss");
    let apart = ["target.exr", "above.exr"].map(|target| {
        let more = if target == "above.exr" { masked } else { "" };
        gradient("", &view(target, more), "--loss")
    });
    assert!((0..2).all(|p| near(both[p], apart[0][p] + apart[1][p])), "{both:?} {apart:?}");
    let above = &apart[1];
    // The mask and `relative` count, also of a picture that is named beside the job.
    let plain = gradient("", &view("above.exr", "sensor = \"above\""), "--loss");
    assert!((plain[0] - above[0]).abs() > 0.1 * plain[0].abs(), "{plain:?} {above:?}");
    let target = "targets = [\"above.exr\"]\nsensors = [\"above\"]\nmasks = [\"half.png\"]\n";
    assert_eq!(&gradient("", target, "--loss above.exr"), above);
    folder.file("views.toml", format!("{JOB}[optimize]\n{}", view("target.exr", moved)));
    expect(&folder.run("grad views.toml --loss target.exr -o g.npy"), 2, &["without a file"]);
    folder.file("views.toml", JOB);
    expect(&folder.run("grad views.toml --loss -o g.npy"), 2, &["no [optimize]", "--loss FILE"]);
}

/// The whole cage, and the whole of the shape's vertices, shifted alike, shift the shape.
#[test]
fn groups_have_gradients_in_reverse() {
    let folder = folder("");
    folder.file("cage.obj", CAGE);
    let job = text(&folder, "job.toml");
    let groups = "\n[[parameter]]\nname = \"up\"\n[[parameter.effect]]\ntarget = \"floor\"\n\
                  translate = [0.0, 0.0, 1.0]\n\
                  [[parameter_group]]\ntarget = \"floor\"\nvertices = \"all\"\n\
                  [[parameter_group]]\ntarget = \"floor\"\ncage = { mesh = \"cage.obj\" }\n";
    folder.file("groups.toml", format!("{job}{groups}"));
    expect(&folder.run("grad groups.toml -o a.exr"), 2, &["[[parameter_group]] has a gradient"]);
    for options in ["--loss target.exr", "--adjoint target.exr"] {
        let line = format!("grad groups.toml --quiet --spp 1024 {options} -o a.npy");
        expect(&folder.run(&line), 0, &[]);
        let numbers = array(&folder, "a.npy");
        assert_eq!(numbers.len(), 3 + 3 * 4 + 3 * 8);
        let lift =
            |range: std::ops::Range<usize>| numbers[range].iter().skip(2).step_by(3).sum::<f64>();
        let (up, vertices, cage) = (numbers[2], lift(3..15), lift(15..39));
        assert!((vertices - cage).abs() < 1e-9 * cage.abs(), "{vertices} {cage}");
        assert!((up - vertices).abs() < 0.05 * up.abs(), "{options}: {up} {vertices}");
    }
    // Only lamps are seen directly, and this one is a point.
    let dark = "grad groups.toml --quiet --spp 4 --max-depth 1 --loss target.exr -o a.npy";
    expect(&folder.run(dark), 0, &["note: group `floor`: its gradient is zero everywhere"]);
    let wrong = format!("{job}[[parameter_group]]\ntarget = \"lamp\"\nvertices = \"all\"\n");
    folder.file("wrong.toml", wrong);
    let line = "grad wrong.toml --loss target.exr -o a.npy";
    expect(&folder.run(line), 2, &["wrong.toml:", "`lamp` is not a shape"]);
}

/// A box around the floor.
const CAGE: &str = "v -2 -2 -1\nv 2 -2 -1\nv 2 2 -1\nv -2 2 -1\nv -2 -2 1\nv 2 -2 1\nv 2 2 1\nv -2 2 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn what_cannot_be_fitted_is_refused_before_anything_is_written() {
    let folder = folder(FIT);
    let refused = |line: &str, parts: &[&str]| {
        expect(&folder.run(line), 2, parts);
        assert!(!folder.path().join("run").exists(), "{line}");
    };
    refused("optimize scene.xml", &["scene.xml is a scene"]);
    refused("optimize job.toml --size 8x8", &["target.exr: it has 16x16 pixels", "8x8"]);
    refused("optimize job.toml --sensor above", &["target.exr: it has 16x16 pixels", "8x8"]);
    refused("optimize job.toml --target-error 0.1", &["--target-error"]);
    let nothing = "[[parameter]]\nname = \"idle\"\n[[parameter.effect]]\ntarget = \"above\"\ntranslate = [1.0, 0.0, 0.0]\n";
    let rates = "learning_rate = { gray = 0.02, lamp-x = 0.05 }";
    let changed = |from: &str, to: &str, parts: &[&str]| {
        let job = format!("{JOB}{FIT}").replace(from, to);
        assert_ne!(job, format!("{JOB}{FIT}"));
        folder.file("other.toml", job);
        refused("optimize other.toml", parts);
    };
    folder.file("idle.toml", format!("{JOB}{nothing}{FIT}").replace(rates, "learning_rate = 0.1"));
    refused("optimize idle.toml", &["idle.toml: parameter `idle` changes nothing"]);
    folder.file("bare.toml", JOB);
    refused("optimize bare.toml", &["bare.toml: it has no [optimize]"]);
    changed("checkpoint_every", "checkpoint_ever", &["other.toml:", "checkpoint_ever"]);
    changed("\"cosine\"", "\"cosin\"", &["other.toml:", "\"cosine\""]);
    changed("gray = 0.02, ", "", &["`learning_rate` has no entry for parameter `gray`"]);
    changed("bounds = { gray", "bounds = { grey", &["`bounds`: there is no parameter `grey`"]);
    changed("[-0.4, 0.4]", "[0.1, 0.4]", &["parameter `gray` starts at 0, outside of its bounds"]);
    // That a fit could not begin there stands in the way of fits alone.
    expect(&folder.run("render other.toml --quiet --spp 1"), 0, &[]);
    changed("weight = 4", "weight = 0", &["other.toml:", "weight 0"]);
    changed("weight = 4", "wait = 4", &["other.toml:"]);
    changed(
        "iterations = 60",
        "iterations = 60, momentum = 0.5",
        &["does not belong to this kind"],
    );
    changed("target.exr", "none.exr", &["none.exr"]);
    changed("\"target.exr\"", "", &["`targets` is empty"]);
    changed("checkpoint = ", "reduce = [[0, 3]]\ncheckpoint = ", &["target.exr", "16x16", "3"]);
    changed("checkpoint = ", "log = [\"gray\"]\ncheckpoint = ", &["must be positive"]);
    changed("checkpoint = ", "sensors = [\"cam\", \"above\"]\ncheckpoint = ", &["one per target"]);
}

#[test]
fn failures_on_the_way_are_told_and_stored() {
    let folder = folder(&FIT.replace("lamp-x = 0.05", "lamp-x = 40.0"));
    // Into the floor.
    let job = text(&folder, "job.toml")
        .replace("translate = [1.0, 0.0, 0.0]", "translate = [0.0, 0.0, -1.0]");
    folder.file("down.toml", job.replace("lamp-x = 40.0", "lamp-x = 300.0"));
    let out = folder.run("optimize down.toml --quiet --set parameter.gray.value=-0.4");
    expect(&out, 1, &["iteration 0: the step to", "`lamp` passed through `floor`"]);
    assert!(text(&folder, "run/report.html").contains("passed through"));
    assert_eq!(text(&folder, "run/params.csv").lines().count(), 2);
    // A fourth of a step does not reach the floor, and what is halved is the step of all parameters.
    std::fs::remove_dir_all(folder.path().join("run")).unwrap();
    folder.file("down.toml", job.replace("lamp-x = 40.0", "lamp-x = 3.0"));
    let out = folder.run("optimize down.toml --iterations 1 --set parameter.gray.value=-0.4");
    expect(&out, 0, &["a step is not possible", "`lamp` passed through `floor`", "halved"]);
    let [gray, lamp] = result(&folder)[..] else { panic!() };
    assert!((gray + 0.395).abs() < 1e-6 && (lamp - 0.75).abs() < 1e-6, "{gray} {lamp}");
    // Steps too far, back and forth.
    std::fs::remove_dir_all(folder.path().join("run")).unwrap();
    let moves = "target = \"lamp\"\ntranslate = [1.0, 0.0, 0.0]";
    let brightens = "target = \"lamp\"\nproperty = \"intensity\"\nadd = [1.0, 1.0, 1.0]";
    let far = "kind = \"sgd\", learning_rate = { gray = 0.0, lamp-x = 50.0 }";
    let near = "kind = \"adam\", learning_rate = { gray = 0.02, lamp-x = 40.0 }";
    let bright = text(&folder, "job.toml").replace(moves, brightens).replace(near, far);
    folder.file("bright.toml", bright);
    expect(&folder.run("optimize bright.toml --quiet"), 1, &["the loss diverges", "learning rate"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_stores_and_the_rest_follows() {
    let [whole, broken] = [(); 2].map(|()| folder(FIT));
    expect(&whole.run("optimize job.toml --quiet"), 0, &[]);
    let mut child =
        broken.command("optimize job.toml --quiet --set estimator.spp=16").spawn().unwrap();
    let started = |p: &Path| p.join("run/target.png").exists();
    while !started(broken.path()) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(broken.path().join("run/checkpoint.json").is_file());
    expect(&broken.run("optimize job.toml --quiet"), 0, &[]);
    assert_eq!(outcome(&whole), outcome(&broken));
}

#[test]
fn a_checkpoint_knows_all_that_it_was_made_from() {
    let folder = folder(FIT);
    let plane = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";
    folder.file("mesh.obj", plane);
    folder.file("inc.xml", "<scene version=\"3.0.0\"><default name=\"w\" value=\"0\"/></scene>");
    let more = "<include filename=\"inc.xml\"/><shape type=\"obj\"><string name=\"filename\" value=\"mesh.obj\"/>\
                <transform name=\"to_world\"><translate z=\"-1\" x=\"$w\"/></transform></shape></scene>";
    folder.file("scene.xml", SCENE.replace("</scene>", more));
    let line = "optimize job.toml --quiet --iterations 2";
    expect(&folder.run(line), 0, &[]);
    let target = std::fs::read(folder.path().join("target.exr")).unwrap();
    let tables = text(&folder, "run/params.csv");
    let files = [
        ("mesh.obj", text(&folder, "mesh.obj"), "mesh.obj has changed since"),
        ("inc.xml", text(&folder, "inc.xml"), "inc.xml has changed since"),
        ("scene.xml", text(&folder, "scene.xml"), "scene.xml has changed since"),
    ];
    for (name, before, part) in &files {
        folder.file(name, format!("{before}\n"));
        expect(&folder.run(line), 2, &["checkpoint.json: it belongs to another problem", part]);
        folder.file(name, before);
    }
    render(&folder, "-o target.exr --seed 4");
    expect(&folder.run(line), 2, &["target.exr has changed since"]);
    folder.file("target.exr", target);
    expect(&folder.run(&format!("{line} -D w=0.5")), 2, &["-D w was not given and is `0.5` now"]);
    folder.file("run/params.csv", tables.replacen("1,", "1,1", 1));
    expect(&folder.run(line), 2, &["run/params.csv: its numbers are not those"]);
    folder.file("run/params.csv", tables);
    expect(&folder.run("optimize job.toml --quiet --iterations 3"), 0, &[]);
}

#[test]
fn what_a_fit_reads_is_not_overwritten() {
    let folder = folder(&FIT.replace("target.exr", "run/target.png"));
    std::fs::create_dir(folder.path().join("run")).unwrap();
    render(&folder, "-o run/target.png");
    expect(&folder.run("optimize job.toml --quiet"), 2, &["run/target.png would be overwritten"]);
    for output in ["-o target.exr", "--digest job.toml", "--digest run/report.html"] {
        let job = format!("{JOB}{FIT}");
        folder.file("job.toml", &job);
        render(&folder, "-o target.exr");
        expect(&folder.run(&format!("optimize job.toml --quiet {output}")), 2, &["overwritten"]);
        assert_eq!(text(&folder, "job.toml"), job);
    }
    folder.file("file", "");
    folder.file("job.toml", format!("{JOB}{}", FIT.replace("\"run\"", "\"file\"")));
    expect(&folder.run("optimize job.toml --quiet"), 3, &["file is not a folder"]);
}

#[test]
fn steps_end_where_properties_have_a_meaning() {
    // The target is black, as no more than a reflectance of nothing makes it.
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    let fit = "[optimize]\ntargets = [\"target.exr\"]\ncheckpoint = \"run\"\n\
               optimizer = { kind = \"adam\", learning_rate = 0.2, iterations = 6 }\n";
    let job = JOB.replace("[[parameter]]\nname = \"lamp-x\"", "[[unused]]");
    let job = job.split("[[unused]]").next().unwrap();
    folder.file("job.toml", format!("{job}{fit}"));
    folder.file(
        "dark.xml",
        SCENE.replace("1\"/></emitter>", "1\"/><rgb name=\"intensity\" value=\"0\"/></emitter>"),
    );
    expect(&folder.run("render dark.xml --quiet --spp 64 -o target.exr"), 0, &[]);
    let out = folder.run("optimize job.toml");
    expect(
        &out,
        0,
        &["would take parameter `gray` out of range (", "\"reflectance\" is", "0 or more"],
    );
    assert_eq!(String::from_utf8_lossy(&out.stderr).matches("out of range").count(), 1);
    let [gray] = result(&folder)[..] else { panic!() };
    assert!((-0.5..=-0.49).contains(&gray), "{gray}");
    assert!(text(&folder, "run/report.html").contains("out of range"));
}
