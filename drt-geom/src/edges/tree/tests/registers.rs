//! What computes with wide registers and what does not give the same bits.

use alloc::vec::Vec;

use crate::procedural;
use drt_math::{Rng, Vec3};

use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;
use crate::edges::{Lobe, Lobes};

#[test]
fn all_registers_give_the_same_bits() {
    let bumpy = procedural::bumpy_sphere(4, 0.15, 6.0);
    let mut all = segments(&moved(&bumpy, 0.9, Vec3::splat(0.2)), PRIORS);
    all.extend(still_life());
    let widest = EdgeTree::new(&all).unwrap();
    let portable = EdgeTree::new(&all).unwrap().portable();
    let (mut rng, mut found) = (Rng::new(8, 0, 0), 0);
    for i in 0..20_000 {
        let normal = [None, Some(false), Some(true)][i % 3];
        let normal = normal.map(|through| (direction(&mut rng), through));
        let lobes = [0, 1].map(|_| Lobe::new(direction(&mut rng), 0.02, rng.next_f64()));
        let scattering = if i % 2 == 0 { Lobes::even(0.3) } else { Lobes { even: 0.1, lobes } };
        let view = Viewpoint::new(in_cube(&mut rng) * 2.0, normal).scattering(scattering);
        let toward = view.toward(0.6, in_cube(&mut rng), 0.4);
        let ways = [toward, Way::anywhere(0.4)];
        let draw = Draw { way: rng.next_f64(), point: rng.next_2d() };
        let [wide, plain]: [Vec<u64>; 2] = [&widest, &portable].map(|tree| {
            let options = &mut TreeScratch::default();
            let amounts = ways.iter().map(|way| tree.amount(&view, way, options).to_bits());
            let mut bits: Vec<u64> = amounts.collect();
            if let Some(c) = tree.sample(&view, &ways, &draw, options) {
                bits.extend([c.edge as u64, c.u.to_bits(), c.inv_pdf.to_bits()]);
            }
            bits
        });
        assert_eq!(wide, plain, "from {view:?}");
        found += u32::from(wide.len() > 2);
    }
    assert!(found > 10_000, "{found}");
}
