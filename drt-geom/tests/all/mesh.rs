//! Meshes: checks, measures, maps and normals.

use drt_geom::procedural::{cube, icosphere, rectangle, uv_sphere};
use drt_geom::{Mesh, MeshError, Topology, weld};
use drt_math::{Affine, Mat3, Vec3, vec3};

#[test]
fn unusable_arrays_are_refused() {
    let p = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    for bad in [f64::NAN, f64::INFINITY] {
        let mut q = p.clone();
        q[1].z = bad;
        assert_eq!(Mesh::new(q, vec![[0, 1, 2]]), Err(MeshError::BadPosition { vertex: 1 }));
    }
    let error = Mesh::new(p.clone(), vec![[0, 1, 2], [0, 3, 1]]).unwrap_err();
    assert_eq!(error, MeshError::IndexOutOfRange { triangle: 1, index: 3, count: 3 });
    assert!(error.to_string().contains("triangle 1"));
    let m = Mesh::new(p, vec![[0, 1, 2]]).unwrap();
    assert!(m.clone().with_normals(vec![Vec3::Z; 2]).is_err());
    assert_eq!(
        m.clone().with_normals(vec![Vec3::Z, Vec3::ZERO, Vec3::Z]),
        Err(MeshError::BadNormal { vertex: 1 })
    );
    assert!(m.clone().with_source(vec![0, 1, 5], 5).is_err());
    assert_eq!(m.clone().with_source(vec![0, 1, 2], 3).unwrap().source_vertices, None);
    let split = m.with_source(vec![4, 1, 4], 5).unwrap();
    assert_eq!((split.source_vertex(0), split.source_vertex(1)), (4, 1));
}

#[test]
fn normals_and_areas() {
    let m = cube();
    for i in 0..12 {
        let center: Vec3 = m.triangle(i).into_iter().fold(Vec3::ZERO, |a, b| a + b);
        assert!(m.normal(i).dot(center) > 0.0);
        assert_eq!(m.area(i), 2.0);
    }
    for scale in [1e-150, 1e-6, 1e6, 1e150] {
        let big = m.transform(&Affine::about(Mat3::diagonal(Vec3::splat(scale)), Vec3::ZERO));
        assert_eq!((0..12).map(|i| big.normal(i)).collect::<Vec<_>>(), {
            (0..12).map(|i| m.normal(i)).collect::<Vec<_>>()
        });
    }
    let line = Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0], vec![[0, 1, 2]]).unwrap();
    assert_eq!((line.normal(0), line.area(0)), (Vec3::ZERO, 0.0));
    let far = m.transform(&Affine::translation(Vec3::splat(1e6)));
    assert!((far.volume() - 8.0).abs() < 1e-9);
}

#[test]
fn maps_keep_the_outside_outside() {
    let turn = Mat3::rotation(vec3(0.0, 0.6, 0.8), 1.1);
    let stretch = Mat3::diagonal(vec3(2.0, 0.5, 1.5));
    for (mirror, sign) in
        [(Vec3::splat(1.0), 1.0), (vec3(-1.0, 1.0, 1.0), -1.0), (Vec3::splat(-1.0), -1.0)]
    {
        let map = Affine {
            linear: turn * stretch * Mat3::diagonal(mirror),
            translation: vec3(3.0, -2.0, 1.0),
        };
        assert_eq!(map.linear.determinant().signum(), sign);
        let m = uv_sphere(24).transform(&map);
        assert!((m.volume() / (1.5 * uv_sphere(24).volume()) - 1.0).abs() < 1e-12);
        let normals = m.normals.as_ref().unwrap();
        for (i, t) in (0..).zip(&m.triangles) {
            for &v in t {
                let n = normals[v as usize];
                assert!((n.length() - 1.0).abs() < 1e-14);
                assert!(n.dot(m.normal(i)) > 0.9, "{}", n.dot(m.normal(i)));
            }
        }
        // The exact normal of the ellipsoid.
        let back = map.inverse();
        for (p, n) in m.positions.iter().zip(normals) {
            let exact = back.linear.transpose_mul(back.point(*p)).normalize();
            assert!((*n - exact).length() < 1e-12);
        }
    }
    let mut inward = cube();
    inward.flip();
    assert_eq!(inward.volume(), -8.0);
    let mut twice = uv_sphere(5);
    twice.flip();
    twice.flip();
    assert_eq!(twice, uv_sphere(5));
}

#[test]
fn degenerate_and_repeated_triangles_are_dropped() {
    let mut m = rectangle();
    let [a, b, c] = m.triangles[0];
    // A copy of vertex a: repetition is by position.
    m.positions.push(m.positions[a as usize]);
    let copy = m.positions.len() as u32 - 1;
    m.triangles.extend([[b, c, copy], [a, a, b], [a, copy, c], [a, c, b]]);
    let (clean, dropped) = m.drop_degenerate();
    assert_eq!(dropped, 3);
    assert_eq!(clean.triangles[..2], m.triangles[..2]);
    // The opposite side of a sheet is not a repetition.
    assert_eq!(clean.triangles[2], [a, c, b]);
    assert_eq!(clean.positions, m.positions);
}

#[test]
fn smooth_normals_do_not_see_the_cut() {
    // Angle weights: a cube's corner has its diagonal, however its faces are cut.
    let m = cube().with_smooth_normals();
    for (p, n) in m.positions.iter().zip(m.normals.as_ref().unwrap()) {
        assert!((p.normalize() - *n).length() < 1e-14);
    }
    let soup: Vec<_> = icosphere(3).soup().into_iter().flatten().collect();
    let triangles = (0..soup.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let m = Mesh::new(soup, triangles).unwrap().with_smooth_normals();
    for (p, n) in m.positions.iter().zip(m.normals.as_ref().unwrap()) {
        assert!((*p - *n).length() < 0.01);
    }
    // A sheet has no mean side; its normals are unit vectors all the same.
    let mut sheet = rectangle();
    let back: Vec<_> = sheet.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect();
    sheet.triangles.extend(back);
    for n in sheet.with_smooth_normals().normals.unwrap() {
        assert_eq!(n.z.abs(), 1.0);
    }
}

#[test]
fn welding_merges_equal_positions_only() {
    let p =
        [vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(-0.0, 1.0, 0.0), vec3(1.0, 0.0, 1e-300)];
    assert_eq!(weld(&p), [0, 1, 0, 3]);
    assert!(Topology::of(&uv_sphere(6)).is_closed());
}

#[cfg(feature = "serde")]
#[test]
fn stored_meshes_come_back_and_are_checked() {
    let m = uv_sphere(4).with_source((0..26).map(|i| i + 3).collect(), 40).unwrap();
    let json = serde_json::to_string(&m).unwrap();
    assert_eq!(serde_json::from_str::<Mesh>(&json).unwrap(), m);
    let cube = cube();
    let json = serde_json::to_string(&cube).unwrap();
    assert_eq!(serde_json::from_str::<Mesh>(&json).unwrap(), cube);
    let broken = json.replacen("\"triangles\":[[0", "\"triangles\":[[99", 1);
    let error = serde_json::from_str::<Mesh>(&broken).unwrap_err();
    assert!(error.to_string().contains("vertex 99"), "{error}");
    let topology = Topology::of(&cube);
    let json = serde_json::to_string(&topology).unwrap();
    assert_eq!(serde_json::from_str::<Topology>(&json).unwrap(), topology);
}

#[test]
fn points_may_be_those_of_glam() {
    use drt_geom::{Aabb, Ray, Skip, TriangleBvh, nearest_point};
    use drt_math::glam::DVec3;

    let corners = vec![DVec3::X, DVec3::Y, DVec3::Z];
    let mesh = Mesh::new(corners.clone(), vec![[0, 1, 2]]).unwrap();
    assert_eq!(mesh, Mesh::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]]).unwrap());
    let smooth = mesh.clone().with_normals(vec![DVec3::ONE; 3]).unwrap();
    assert!(smooth.normals.is_some());
    assert_eq!(Aabb::around(corners.clone()), Aabb::around(mesh.positions.clone()));

    let bvh = TriangleBvh::of(&mesh).unwrap();
    let hit = bvh.closest(&Ray::new(DVec3::ZERO, [1.0; 3]), Skip::NOTHING).unwrap();
    assert!((hit.t - 1.0 / 3.0).abs() < 1e-15);
    assert!(bvh.any(&Ray::segment([0.0; 3], DVec3::ONE), Skip::NOTHING, |_| true));
    let nearest = bvh.closest_point(DVec3::ZERO).unwrap().point;
    assert_eq!(nearest, nearest_point([corners[0], corners[1], corners[2]], Vec3::ZERO));
}

#[test]
fn texture_coordinates_stay_with_their_corners() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let triangles = vec![[0, 1, 2], [0, 1, 1], [1, 3, 2]];
    let mesh = Mesh::new(positions.to_vec(), triangles).unwrap();
    let uv = |corners: [u32; 3]| {
        corners.map(|v| [positions[v as usize][0], 10.0 * positions[v as usize][1]])
    };
    let texcoords = mesh.triangles.iter().map(|t| uv(*t)).collect::<Vec<_>>();
    let mesh = mesh.with_texcoords(texcoords.clone()).unwrap();
    // Between the corners, by the weights of the second and the third.
    let [u, v] = mesh.texcoord(2, [0.25, 0.5]);
    assert!((u - 0.5).abs() < 1e-15 && (v - 7.5).abs() < 1e-14);
    let matches = |m: &Mesh| {
        m.triangles.iter().zip(m.texcoords.as_ref().unwrap()).all(|(t, corners)| *corners == uv(*t))
    };
    let mut flipped = mesh.clone();
    flipped.flip();
    let (clean, dropped) = mesh.drop_degenerate();
    assert_eq!((dropped, clean.triangles.len()), (1, 2));
    assert!(matches(&mesh) && matches(&flipped) && matches(&clean));
    let mirror =
        drt_math::Affine::about(drt_math::Mat3::diagonal(vec3(-1.0, 1.0, 1.0)), Vec3::ZERO);
    assert!(matches(&mesh.transform(&mirror)));

    let plain = || Mesh { texcoords: None, ..mesh.clone() };
    let mut bad = texcoords.clone();
    bad[1][2][0] = f64::NAN;
    let error = plain().with_texcoords(bad).unwrap_err();
    assert_eq!(error, drt_geom::MeshError::BadTexcoords { triangle: 1 });
    let error = plain().with_texcoords(texcoords[..2].to_vec()).unwrap_err();
    assert_eq!(error, drt_geom::MeshError::BadTexcoords { triangle: 2 });
    // Without any they are the weights, as in Mitsuba.
    assert_eq!(plain().texcoord(0, [0.2, 0.3]), [0.2, 0.3]);
}
