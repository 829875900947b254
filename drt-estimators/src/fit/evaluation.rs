//! The loss, gradient and curvature that an iteration computes from its images.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::dense::zeros;
use drt_math::{Rgb, fm};

use crate::fit::View;
use crate::fit::linear::{newton_noise, newton_step};
use crate::fit::loss::{Loss, inner};
use crate::model::error::{Error, SettingError};
use crate::model::rendering::{Layer, Rendering};

/// Sides of the squares of pixels whose errors are taken together, because filters may spread one
/// sample over several pixels.
const SQUARE: u32 = 4;

/// Image and derivatives of a view from half of the samples.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Half {
    /// Row by row from the top left.
    pub image: Vec<Rgb>,
    /// An image per parameter.
    pub derivatives: Vec<Vec<Rgb>>,
    /// Contributions that were not finite.
    pub non_finite: u64,
}

impl From<&Rendering> for Half {
    fn from(rendering: &Rendering) -> Self {
        let derivatives = rendering.derivatives.iter().map(|d| means(&d.total)).collect();
        let (image, non_finite) = (means(&rendering.image), rendering.non_finite);
        Self { image, derivatives, non_finite }
    }
}

pub(super) fn means(layer: &Layer) -> Vec<Rgb> {
    layer.pixels.iter().map(|p| p.mean).collect()
}

/// One view by both halves.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub(super) halves: [Half; 2],
}

impl Seen {
    fn image(&self) -> Vec<Rgb> {
        let [a, b] = &self.halves;
        mean(&a.image, &b.image)
    }

    fn derivative(&self, parameter: usize) -> Vec<Rgb> {
        let [a, b] = &self.halves;
        mean(&a.derivatives[parameter], &b.derivatives[parameter])
    }
}

/// The images and derivatives of all views of a [`Fit`](super::Fit), at some values of the parameters.
#[derive(Clone, Debug)]
pub struct Evaluation {
    loss: Loss,
    views: Arc<[View]>,
    /// Indices of the views that have been rendered, in the order of `seen`.
    which: Vec<usize>,
    seen: Vec<Seen>,
    parameters: usize,
    /// The gradient with respect to each group of unknowns.
    groups: Vec<Vec<f64>>,
}

impl Evaluation {
    /// The evaluation of a loss from both halves of the samples of all views; each half has a derivative image for each
    /// of `parameters`.
    ///
    /// # Errors
    /// When the number of halves, their sizes or their derivatives do not match the views and parameters.
    pub fn of(
        loss: Loss,
        views: impl Into<Arc<[View]>>,
        halves: Vec<[Half; 2]>,
        parameters: usize,
    ) -> Result<Self, Error> {
        let views = views.into();
        let all = (0..views.len()).collect();
        Self::of_some(loss, views, all, halves, parameters)
    }

    /// The evaluation from both halves of the samples of some views, which are given by their indices.
    pub(super) fn of_some(
        loss: Loss,
        views: Arc<[View]>,
        which: Vec<usize>,
        halves: Vec<[Half; 2]>,
        parameters: usize,
    ) -> Result<Self, Error> {
        let fits = |view: &View, half: &Half| {
            let [w, h] = view.reference.size();
            let n = w as usize * h as usize;
            half.derivatives.len() == parameters
                && [&half.image].into_iter().chain(&half.derivatives).all(|i| i.len() == n)
        };
        let all = which.iter().zip(&halves).all(|(v, seen)| {
            views.get(*v).is_some_and(|view| seen.iter().all(|half| fits(view, half)))
        });
        if halves.len() != which.len() || which.is_empty() || !all {
            return Err(Error::Setting { setting: "halves", reason: SettingError::ForeignHalves });
        }
        let seen = halves.into_iter().map(|halves| Seen { halves }).collect();
        Ok(Self { loss, views, which, seen, parameters, groups: Vec::new() })
    }

    /// Whether a view has been rendered; an evaluation may be of some views only.
    #[must_use]
    pub fn sees(&self, view: usize) -> bool {
        self.which.contains(&view)
    }

    /// Whether all views have been rendered.
    #[must_use]
    pub fn sees_all(&self) -> bool {
        self.which.len() == self.views.len()
    }

    /// The factor that takes sums over the rendered views to sums over all views.
    fn scale(&self) -> f64 {
        self.views.len() as f64 / self.which.len() as f64
    }

    /// Adds the gradient with respect to each group of unknowns.
    pub(super) fn with_groups(mut self, mut groups: Vec<Vec<f64>>) -> Self {
        let scale = self.scale();
        groups.iter_mut().flatten().for_each(|g| *g *= scale);
        self.groups = groups;
        self
    }

    /// The gradient of the loss with respect to the values of a [`Group`](super::Group), in their order; empty where
    /// there is no such group.
    #[must_use]
    pub fn group_gradient(&self, group: usize) -> &[f64] {
        self.groups.get(group).map_or(&[], Vec::as_slice)
    }

    fn pairs(&self) -> impl Iterator<Item = (&View, &Seen)> {
        self.which.iter().map(|v| &self.views[*v]).zip(&self.seen)
    }

    /// The loss of the images from all samples, summed over views. The noise of the images adds to it.
    #[must_use]
    pub fn loss(&self) -> f64 {
        let losses = self.pairs().map(|(v, s)| self.loss.value(&s.image(), &v.reference));
        self.scale() * losses.sum::<f64>()
    }

    /// The gradient of the loss with respect to the parameters, from images and derivatives with independent errors.
    #[must_use]
    pub fn gradient(&self) -> Vec<f64> {
        let mut gradient = alloc::vec![0.0; self.parameters];
        for (view, seen) in self.pairs() {
            for (image, other) in [(0, 1), (1, 0)] {
                let adjoint = self.loss.adjoint(&seen.halves[image].image, &view.reference);
                for (sum, d) in gradient.iter_mut().zip(&seen.halves[other].derivatives) {
                    *sum += 0.5 * self.scale() * inner(&adjoint, d);
                }
            }
        }
        gradient
    }

    /// The covariance of the [gradient](Self::gradient)'s errors, one row per parameter.
    ///
    /// It is estimated from the difference of the halves, to first order in the noise; errors of pixels that are far
    /// apart are taken to be independent.
    #[must_use]
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let n = self.parameters;
        let mut covariance = zeros(n);
        for (view, seen) in self.pairs() {
            let image = seen.image();
            let value = self.loss.value(&image, &view.reference);
            let adjoint = self.loss.adjoint(&image, &view.reference);
            let [a, b] = &seen.halves;
            let of = |p: usize| {
                let slope = self.loss.curvature(&seen.derivative(p), value, &view.reference);
                let product = |i: usize| {
                    adjoint[i].dot(a.derivatives[p][i] - b.derivatives[p][i])
                        + slope[i].dot(a.image[i] - b.image[i])
                };
                in_squares(view.reference.size(), product)
            };
            let differences: Vec<Vec<f64>> = (0..n).map(of).collect();
            for (row, x) in covariance.iter_mut().zip(&differences) {
                for (sum, y) in row.iter_mut().zip(&differences) {
                    let square = self.scale() * self.scale();
                    *sum += 0.25 * square * x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
                }
            }
        }
        covariance
    }

    /// The standard errors of the [gradient](Self::gradient).
    #[must_use]
    pub fn gradient_errors(&self) -> Vec<f64> {
        let covariance = self.covariance();
        covariance.iter().enumerate().map(|(i, row)| fm::sqrt(row[i])).collect()
    }

    /// The Gauss-Newton approximation of the loss's second derivatives, from the first derivatives of the images, one
    /// row per parameter; as unbiased as the gradient.
    #[must_use]
    pub fn curvature(&self) -> Vec<Vec<f64>> {
        let n = self.parameters;
        let mut curvature = zeros(n);
        for (view, seen) in self.pairs() {
            let value = self.loss.value(&seen.image(), &view.reference);
            for (first, second) in [(0, 1), (1, 0)] {
                for (j, d) in seen.halves[first].derivatives.iter().enumerate() {
                    let curved = self.loss.curvature(d, value, &view.reference);
                    for (k, other) in seen.halves[second].derivatives.iter().enumerate() {
                        let product = 0.25 * self.scale() * inner(&curved, other);
                        curvature[j][k] += product;
                        curvature[k][j] += product;
                    }
                }
            }
        }
        curvature
    }

    /// The part that the noise of the derivatives adds to their squares, in the units of
    /// [`curvature`](Self::curvature). The sum of both is the mean of the curvatures of the single halves, which are
    /// positive but biased.
    #[must_use]
    pub fn curvature_noise(&self) -> Vec<Vec<f64>> {
        let n = self.parameters;
        let mut noise = zeros(n);
        for (view, seen) in self.pairs() {
            let value = self.loss.value(&seen.image(), &view.reference);
            let [a, b] = &seen.halves;
            let differences: Vec<Vec<Rgb>> = (0..n)
                .map(|p| {
                    let pairs = a.derivatives[p].iter().zip(&b.derivatives[p]);
                    pairs.map(|(a, b)| *a - *b).collect()
                })
                .collect();
            for (row, d) in noise.iter_mut().zip(&differences) {
                let curved = self.loss.curvature(d, value, &view.reference);
                for (sum, other) in row.iter_mut().zip(&differences) {
                    *sum += 0.5 * self.scale() * inner(&curved, other);
                }
            }
        }
        noise
    }

    /// The standard error of a Newton step that is due to the noise of this evaluation, per parameter: a
    /// measure of how well the samples determine the values. `None` where the images do not distinguish the
    /// parameters.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Vec<f64>> {
        newton_noise(&self.curvature(), &self.covariance())
    }

    /// The change of the parameters by a Newton step, an estimate of their distance from the optimum. `None`
    /// as for [`uncertainty`](Self::uncertainty).
    #[must_use]
    pub fn newton_step(&self) -> Option<Vec<f64>> {
        let step = newton_step(&self.curvature(), &self.gradient())?;
        Some(step.into_iter().map(|s| -s).collect())
    }

    /// The image of a view from all samples, row by row from the top left.
    ///
    /// # Panics
    /// When there is no such view, or it has not been [seen](Self::sees).
    #[must_use]
    pub fn image(&self, view: usize) -> Vec<Rgb> {
        self.of_view(view).image()
    }

    fn of_view(&self, view: usize) -> &Seen {
        let place = self.which.iter().position(|v| *v == view);
        &self.seen[place.unwrap_or(usize::MAX)]
    }

    /// The derivative of a view's image with respect to a parameter, from all samples.
    ///
    /// # Panics
    /// When there is no such view or parameter, or the view has not been [seen](Self::sees).
    #[must_use]
    pub fn derivative(&self, view: usize, parameter: usize) -> Vec<Rgb> {
        self.of_view(view).derivative(parameter)
    }

    /// True when the derivative with respect to a parameter is zero in every pixel of every view.
    ///
    /// # Panics
    /// When there is no such parameter.
    #[must_use]
    pub fn is_blind_to(&self, parameter: usize) -> bool {
        let halves = self.seen.iter().flat_map(|s| &s.halves);
        halves.into_iter().all(|h| h.derivatives[parameter].iter().all(|d| d.is_zero()))
    }

    /// Contributions that were not finite; they count as zero.
    #[must_use]
    pub fn non_finite(&self) -> u64 {
        self.seen.iter().flat_map(|s| &s.halves).map(|h| h.non_finite).sum()
    }
}

fn mean(a: &[Rgb], b: &[Rgb]) -> Vec<Rgb> {
    a.iter().zip(b).map(|(a, b)| (*a + *b) * 0.5).collect()
}

/// Sums of a number per pixel over squares of pixels.
fn in_squares([w, h]: [u32; 2], value: impl Fn(usize) -> f64) -> Vec<f64> {
    let columns = w.div_ceil(SQUARE);
    let mut sums = alloc::vec![0.0; (columns * h.div_ceil(SQUARE)) as usize];
    for y in 0..h {
        for x in 0..w {
            sums[(y / SQUARE * columns + x / SQUARE) as usize] += value((y * w + x) as usize);
        }
    }
    sums
}
