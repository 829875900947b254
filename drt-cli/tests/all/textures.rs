//! Texels as parameters, by the `drt` program.

use crate::common::{Folder, expect};

/// A wall with a picture on it, of rough plastic under a sky.
fn folder() -> Folder {
    let folder = Folder::new();
    let code = |x, y| [40 + 60 * x as u8, 200 - 50 * y as u8, 90];
    let picture = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb(code(x, y)));
    picture.save(folder.path().join("picture.png")).unwrap();
    folder.file(
        "scene.xml",
        r#"<scene version="3.0.0">
          <integrator type="path"><integer name="max_depth" value="2"/></integrator>
          <sensor type="perspective"><float name="fov" value="40"/>
            <transform name="to_world"><lookat origin="0.3,0.2,3" target="0,0,0" up="0,1,0"/></transform>
            <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
          </sensor>
          <shape type="rectangle" id="wall"><bsdf type="roughconductor" id="paint">
            <texture name="specular_reflectance" type="bitmap"><string name="filename" value="picture.png"/>
              <string name="wrap_mode" value="mirror"/></texture>
            <texture name="alpha" type="bitmap"><string name="filename" value="picture.png"/>
              <boolean name="raw" value="true"/></texture>
          </bsdf></shape>
          <emitter type="envmap" id="sky"><string name="filename" value="picture.png"/></emitter>
          <shape type="rectangle" id="lamp"><bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
            <transform name="to_world"><scale value="0.4"/><rotate y="1" angle="180"/><translate z="1" x="-1.2"/></transform>
            <emitter type="area" id="glow"><texture name="radiance" type="bitmap">
              <string name="filename" value="picture.png"/></texture></emitter></shape>
        </scene>"#,
    );
    folder
}

fn parameter(name: &str, keys: &str) -> String {
    format!("[[parameter]]\nname = \"{name}\"\n[[parameter.effect]]\n{keys}\n")
}

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let bytes = std::fs::read(folder.path().join(name)).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    bytes[header..].chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn texels_are_parameters() {
    let folder = folder();
    let colour = "target = \"wall\"\nproperty = \"specular_reflectance\"\nadd = [1, 2, 3]\n";
    let number = "target = \"paint\"\nproperty = \"alpha\"\nadd = [1, 1, 1]\n";
    let job = |more: &str| format!("scene = \"scene.xml\"\n[estimator]\nspp = 64\n{more}");
    let parameters = parameter("all", &format!("{colour}texels = \"all\""))
        + &parameter("one", &format!("{colour}texels = [2, 1]"))
        + &parameter("rough", &format!("{number}texels = [0, 0]"));
    let light = |id| format!("target = \"{id}\"\nproperty = \"radiance\"\nadd = [1, 2, 3]\n");
    let parameters = parameters
        + &parameter("lamp", &format!("{}texels = \"all\"", light("lamp")))
        + &parameter("sky", &format!("{}texels = [1, 0]", light("sky")))
        + &parameter("turn", "target = \"sky\"\nrotate = { axis = [0.0, 1.0, 0.0] }\n");
    folder.file("job.toml", job(&parameters));
    expect(&folder.run("check job.toml --quiet --spp 128"), 0, &[]);
    // Each in reverse: three numbers for a colour, one for a number.
    let groups = "[[parameter_group]]\ntarget = \"wall\"\nproperty = \"specular_reflectance\"\ntexels = \"all\"\n\
                  [[parameter_group]]\ntarget = \"paint\"\nproperty = \"alpha\"\ntexels = \"all\"\n\
                  [[parameter_group]]\ntarget = \"lamp\"\nproperty = \"radiance\"\ntexels = \"all\"\n\
                  [[parameter_group]]\ntarget = \"sky\"\nproperty = \"radiance\"\ntexels = \"all\"\n";
    folder.file("groups.toml", job(&(parameters + groups)));
    expect(&folder.run("render scene.xml --spp 4 --quiet -o ones.exr"), 0, &[]);
    let line = "grad groups.toml --quiet --adjoint ones.exr -o a.npy --set estimator.guiding=false";
    expect(&folder.run(line), 0, &[]);
    let found = numbers(&folder, "a.npy");
    let [all, one, rough, lamp, sky] = [0, 1, 2, 3, 4].map(|i| found[i]);
    let (colours, rest) = found[6..].split_at(3 * 6);
    let (alphas, rest) = rest.split_at(6);
    let (lamps, skies) = rest.split_at(3 * 6);
    assert_eq!(skies.len(), 3 * 6);
    let sum = |of: &[f64], t: usize| (0..3).map(|c| of[3 * t + c] * (c + 1) as f64).sum::<f64>();
    let of = |t: usize| sum(colours, t);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs();
    assert!(close((0..6).map(of).sum(), all) && close(of(5), one) && close(alphas[0], rough));
    assert!(close((0..6).map(|t| sum(lamps, t)).sum(), lamp) && close(sum(skies, 1), sky));
}

#[test]
fn texels_that_are_not_there_are_refused() {
    let folder = folder();
    let refused = |keys: &str, parts: &[&str]| {
        folder.file("wrong.toml", format!("scene = \"scene.xml\"\n{keys}"));
        folder.file("target.exr", "");
        expect(&folder.run("grad wrong.toml -o a.exr"), 2, parts);
    };
    let effect = |keys: &str| parameter("stain", &format!("add = [1, 1, 1]\n{keys}"));
    let wall = "target = \"wall\"\nproperty = \"specular_reflectance\"\n";
    let parts = ["wrong.toml:2", "`stain`", "no texel [3, 0]; the image has 3 columns and 2 rows"];
    refused(&effect(&format!("{wall}texels = [3, 0]")), &parts);
    refused(&effect(&format!("{wall}texels = [0, 0, 0]")), &["\"all\" or [column, row]"]);
    refused(&effect(&format!("{wall}voxels = [0, 0, 0]")), &["`stain`", "have voxels"]);
    let sky = "target = \"sky\"\nproperty = \"radiance\"\ntexels = [0, 2]";
    refused(&effect(sky), &["`stain`", "no texel [0, 2]"]);
    let storm = "[[parameter]]\nname = \"storm\"\n[[parameter.effect]]\ntarget = \"sky\"\ntranslate = [1, 0, 0]";
    refused(storm, &["`storm`", "can be turned"]);
    let eta = "target = \"wall\"\nproperty = \"eta\"\ntexels = \"all\"";
    refused(&effect(eta), &["`stain`", "no texture stands for `eta`"]);
    let group = "[[parameter_group]]\ntexels = \"all\"\n";
    refused(&format!("{group}target = \"wall\""), &["need the `property`"]);
    refused(
        &format!("{group}{}", eta.replace("texels = \"all\"", "")),
        &["no texture stands for `eta`"],
    );
    // What this BSDF has is told, and not what all of them have.
    let gloss = "target = \"wall\"\nproperty = \"gloss\"\n";
    let parts = ["BSDF has no \"gloss\"; it has: ", "specular_reflectance"];
    refused(&effect(gloss), &parts);
    refused(&format!("{group}{gloss}"), &parts);
}
