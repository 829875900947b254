//! What the layers of a session's films are.

use alloc::string::String;
use alloc::vec::Vec;

use crate::model::rendering::{Derivative, Layer, Term};
use crate::sampling::film::{Blocks, PixelFilm, SplatFilm};

/// Names of what films hold.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Legend {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    /// The image is splatted.
    pub(super) splatted: bool,
    /// By which there are derivatives.
    pub(super) parameters: Vec<String>,
    /// Terms that are found along paths and have layers of their own.
    pub(super) along: Vec<Term>,
    /// Terms of the sources of boundary samples, a film each.
    pub(super) sources: Vec<Term>,
    /// Terms are shown apart.
    pub(super) apart: bool,
}

impl Legend {
    /// Layers of the film of pixels: the image, a derivative per parameter, one per term and parameter.
    pub(super) fn layers(&self) -> usize {
        1 + self.parameters.len() * (1 + self.along.len())
    }

    /// The derivatives in these films.
    pub(super) fn derivatives<'a>(
        &self,
        film: &PixelFilm,
        splats: impl Iterator<Item = &'a SplatFilm>,
        blocks: &Blocks,
    ) -> Vec<Derivative> {
        let n = self.parameters.len();
        let splats: Vec<&SplatFilm> = splats.collect();
        let layer = |l: usize| film.layer(l, blocks);
        let derivative = |(p, name): (usize, &String)| {
            let mut parts = alloc::vec![(Term::Interior, layer(1 + p))];
            let along = self.along.iter().enumerate();
            parts.extend(along.map(|(i, term)| (*term, layer(1 + (i + 1) * n + p))));
            let boundary = self.sources.iter().zip(&splats);
            parts.extend(boundary.map(|(term, film)| (*term, film.layer(p, blocks))));
            let total = sum(parts.iter().map(|(_, l)| l)).unwrap_or_else(|| parts[0].1.clone());
            let mut terms = Vec::new();
            if self.apart {
                for term in Term::ALL {
                    let own = parts.iter().filter(|(t, _)| *t == term).map(|(_, l)| l);
                    terms.extend(sum(own).map(|l| (term, l)));
                }
            }
            Derivative { name: name.clone(), total, terms }
        };
        self.parameters.iter().enumerate().map(derivative).collect()
    }
}

fn sum<'a>(layers: impl Iterator<Item = &'a Layer>) -> Option<Layer> {
    layers.fold(None, |sum, l| {
        Some(match sum {
            None => l.clone(),
            Some(s) => s.plus(l),
        })
    })
}
