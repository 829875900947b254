//! Tetrahedra inside media by TetGen. Needs its library:
//!
//! ```sh
//! sudo apt-get install libtet1.5-dev
//! cargo test --release -p drt-cli --features tetgen --test all tetgen::
//! ```

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective"><float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0 -5 1" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
  <shape type="cube" id="cube"><bsdf type="null"/>
    <medium name="interior" type="homogeneous" id="fog"><float name="sigma_t" value="1"/></medium></shape>
  <emitter type="constant"/>
</scene>"#;

fn job(tetrahedralizer: &str) -> String {
    format!(
        "scene = \"scene.xml\"\n[estimator]\nkind = \"path-space\"\nspp = 256\n\
         [[motion]]\nmedium = \"fog\"\nkind = \"tetrahedral\"\ntetrahedralizer = \"{tetrahedralizer}\"\n\
         [[parameter]]\nname = \"corner\"\n[[parameter.effect]]\ntarget = \"cube\"\n\
         vertex = {{ index = 0, direction = [1.0, 1.0, 1.0] }}\n"
    )
}

/// A velocity inside a medium may be any: tetrahedra by TetGen and by our own program give one derivative.
#[test]
fn derivatives_are_those_by_our_own_tetrahedra() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    let [tetgen, own] = [("tetgen", 1), ("own", 2)].map(|(name, seed)| {
        folder.file("job.toml", job(name));
        let line =
            format!("grad job.toml --quiet -o {name}.exr --digest {name}.json --seed {seed}");
        expect(&folder.run(&line), 0, &[]);
        let derivative = folder.json(&format!("{name}.json"))["derivatives"]["corner"].clone();
        ["mean", "stderr"].map(|key| derivative[key][1].as_f64().unwrap())
    });
    let noise = tetgen[1].hypot(own[1]);
    assert!((tetgen[0] - own[0]).abs() < 4.0 * noise, "{tetgen:?} {own:?}");
    // A derivative of the other sign would be seen.
    assert!((tetgen[0] + own[0]).abs() > 4.0 * noise, "{tetgen:?} {own:?}");
}
