//! `--shard` and `drt merge`: the bits of the run in one piece.

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
      <rfilter type="tent"/></film></sensor>
  <medium type="homogeneous" id="fog"><float name="sigma_t" value="0.6"/><float name="albedo" value="0.7"/></medium>
  <shape type="rectangle"><bsdf type="diffuse"/></shape>
  <shape type="cube" id="cube"><transform name="to_world"><scale value="0.3"/><translate z="0.5"/></transform>
    <bsdf type="diffuse"/></shape>
  <shape type="cube" id="haze"><transform name="to_world"><scale value="0.9"/><translate z="1.0"/></transform>
    <bsdf type="null"/><ref name="interior" id="fog"/></shape>
  <shape type="rectangle" id="lamp"><transform name="to_world"><scale value="0.4"/>
    <lookat origin="1 -1 3" target="0 0 0" up="0 1 0"/></transform>
    <emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>
</scene>"#;

const MOVES: &str = "[[parameter]]\nname = \"x\"\nvalue = 0.1\n[[parameter.effect]]\n\
                     target = \"cube\"\ntranslate = [1.0, 0.0, 0.0]\n";
const GROUP: &str = "[[parameter_group]]\ntarget = \"cube\"\nvertices = \"all\"\n";

fn job(kind: &str, rest: &str) -> String {
    format!("scene = \"scene.xml\"\n[estimator]\nkind = \"{kind}\"\nspp = 32\n{rest}")
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder
}

/// Runs `line` in one piece and in 8 shards, and merges these in another order; both results.
fn both(folder: &Folder, line: &str, ending: &str, digest: &str) -> [Vec<u8>; 2] {
    expect(&folder.run(&format!("{line} --quiet -o whole.{ending}")), 0, &[]);
    let mut parts = String::new();
    for k in [3, 1, 8, 2, 5, 4, 7, 6] {
        let part = format!("{k}.{ending}");
        expect(
            &folder.run(&format!("{line} --quiet --shard {k}/8 -o {part} --threads {}", k % 3)),
            0,
            &[],
        );
        parts += &format!("{part} ");
    }
    expect(&folder.run(&format!("merge {parts} --quiet -o merged.{ending}{digest}")), 0, &[]);
    ["whole", "merged"].map(|n| std::fs::read(folder.path().join(format!("{n}.{ending}"))).unwrap())
}

fn same_images(folder: &Folder, line: &str) {
    both(folder, line, "exr", " --digest merged.json");
    let [whole, merged] = ["whole.exr", "merged.exr"].map(|n| folder.exr(n));
    assert_eq!(whole.layers, merged.layers, "{line}");
    for name in ["drt_spp", "drt_seed", "drt_complete", "drt_scene"] {
        assert_eq!(whole.attributes[name], merged.attributes[name], "{line}");
    }
    // Every bit of every number, errors of blocks and totals included.
    expect(&folder.run(&format!("{line} --quiet --digest whole.json")), 0, &[]);
    let [whole, merged] = ["whole.json", "merged.json"].map(|n| folder.json(n));
    for part in ["image", "derivatives", "counters", "plan", "spp", "non_finite"] {
        assert_eq!(whole[part], merged[part], "{line}: {part}");
    }
}

#[test]
fn merged_images_are_those_of_one_run() {
    let folder = folder();
    same_images(&folder, "render scene.xml --spp 32 --seed 9");
    same_images(&folder, "render scene.xml --spp 32 --seed 9 --sampling bidirectional");
    for kind in ["path-space", "radiative", "warped"] {
        folder.file("job.toml", job(kind, MOVES));
        same_images(&folder, "grad job.toml --terms");
    }
}

#[test]
fn merged_gradients_are_those_of_one_run() {
    let folder = folder();
    expect(&folder.run("render scene.xml --spp 16 -o target.exr --quiet"), 0, &[]);
    for kind in ["path-space", "radiative", "warped"] {
        for (groups, line) in [
            ("", "grad job.toml --loss target.exr"),
            (GROUP, "grad job.toml --loss target.exr"),
            (GROUP, "grad job.toml --adjoint target.exr"),
        ] {
            folder.file("job.toml", job(kind, &format!("{MOVES}{groups}")));
            let [whole, merged] = both(&folder, line, "npy", "");
            assert!(whole == merged && whole.len() > 128, "{kind} {line} {groups}");
        }
    }
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let folder = folder();
    folder.file("job.toml", job("path-space", MOVES));
    folder.file("other.toml", job("path-space", &MOVES.replace("0.1", "0.2")));
    for (line, name) in [
        ("grad job.toml --shard 1/4", "1"),
        ("grad job.toml --shard 2/4", "2"),
        ("grad job.toml --shard 3/4 --seed 8", "seed"),
        ("grad other.toml --shard 3/4", "other"),
        ("grad job.toml --shard 3/5", "fifth"),
        ("render job.toml --shard 3/4", "render"),
        ("grad job.toml", "whole"),
    ] {
        expect(&folder.run(&format!("{line} --quiet -o {name}.exr")), 0, &[]);
    }
    std::fs::copy(folder.path().join("1.exr"), folder.path().join("copy.exr")).unwrap();
    for (line, part) in [
        ("1.exr 2.exr copy.exr", "drt: error: copy.exr: it is shard 1/4, as is 1.exr"),
        ("1.exr 2.exr seed.exr", "seed.exr: it does not belong to 1.exr: it has the seed 8"),
        ("1.exr 2.exr other.exr", "other.exr: it does not belong to 1.exr: it is of another job"),
        ("1.exr 2.exr fifth.exr", "fifth.exr: it does not belong to 1.exr: it is one of 5 shards"),
        (
            "1.exr 2.exr render.exr",
            "render.exr: it does not belong to 1.exr: it is of `drt render`",
        ),
        ("1.exr 2.exr whole.exr", "whole.exr: it is not a shard"),
        ("1.exr 2.exr none.exr", "none.exr: cannot read"),
        ("1.exr 2.exr", "of 4 shards, these are missing: 3, 4; --partial"),
    ] {
        expect(&folder.run(&format!("merge {line} -o m.exr")), 2, &[part]);
        assert!(!folder.path().join("m.exr").exists());
    }
    let bytes = std::fs::read(folder.path().join("2.exr")).unwrap();
    let mut other = bytes;
    let middle = other.len() / 2;
    other[middle] ^= 1;
    folder.file("damaged.exr", other);
    expect(&folder.run("merge 1.exr damaged.exr -o m.exr"), 2, &["damaged.exr: it is damaged"]);

    for (line, part) in [
        ("render scene.xml --shard 0/4 -o m.exr", "--shard"),
        ("render scene.xml --shard 5/4 -o m.exr", "--shard"),
        ("render scene.xml --shard 1/4", "-o FILE.exr"),
        ("render scene.xml --shard 1/4 --seconds 1 -o m.exr", "--seconds does not go with --shard"),
        ("render scene.xml --shard 1/64 -o m.exr", "at most 32"),
    ] {
        expect(&folder.run(line), 2, &[part]);
    }
}

#[test]
fn some_shards_make_a_noisier_image() {
    let folder = folder();
    for k in 1..=4 {
        expect(
            &folder.run(&format!("render scene.xml --spp 64 --shard {k}/4 -o {k}.exr --quiet")),
            0,
            &[],
        );
    }
    let out = folder.run("merge 4.exr 2.exr --partial -o some.exr --digest some.json");
    expect(&out, 0, &["these are missing: 1, 3", "32 spp", "incomplete"]);
    expect(&folder.run("merge 1.exr 2.exr 3.exr 4.exr --digest all.json --quiet"), 0, &[]);
    let [some, all] = ["some.json", "all.json"].map(|n| folder.json(n));
    let [wide, narrow] = [&some, &all].map(|d| d["image"]["stderr"][1].as_f64().unwrap());
    let [a, b] = [&some, &all].map(|d| d["image"]["mean"][1].as_f64().unwrap());
    assert!(wide > 1.1 * narrow && (a - b).abs() < 4.0 * wide, "{wide} {narrow} {a} {b}");
    assert_eq!((&some["complete"], &some["spp"]), (&false.into(), &32.into()));
    assert_eq!(folder.exr("some.exr").attributes["drt_complete"], "0");
}
