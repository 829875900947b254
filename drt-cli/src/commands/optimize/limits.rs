//! Steps that would lead out of where properties have a meaning.

use crate::commands::console;

/// How near to the limit a step comes, of the way there: a limit itself may have no meaning, as a roughness of zero.
const PART: f64 = 0.9;
/// Halvings that find the limit.
const HALVINGS: u32 = 20;

/// Parameters whose steps were shortened, and why.
#[derive(Default)]
pub(super) struct Limits(Vec<(String, String)>);

impl Limits {
    /// Takes note of a shortened step; the first one of each parameter is told.
    pub(super) fn note(&mut self, parameter: &str, iteration: u32, reason: &str, aloud: bool) {
        if self.0.iter().any(|(name, _)| name == parameter) {
            return;
        }
        let note = format!(
            "iteration {iteration}: a step would take parameter `{parameter}` out of range ({reason}); it was shortened to \
             nine tenths of the way to the limit, as later ones are without a note"
        );
        self.tell(parameter, note, aloud);
    }

    /// Notes that a step of all unknowns was halved.
    pub(super) fn note_halved(&mut self, iteration: u32, reason: &str, aloud: bool) {
        // No parameter has this name.
        let name = "";
        if self.0.iter().any(|(known, _)| known == name) {
            return;
        }
        let note = format!(
            "iteration {iteration}: a step is not possible ({reason}); it was halved, as later ones are without a note"
        );
        self.tell(name, note, aloud);
    }

    fn tell(&mut self, name: &str, note: String, aloud: bool) {
        if aloud {
            console::note(format_args!("drt: {note}"));
        }
        self.0.push((name.into(), note));
    }

    pub(super) fn notes(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(_, note)| note.as_str())
    }
}

/// The values that a step from `before` to `after` reaches when it is shortened for one parameter, or for all, until they are
/// not `beyond` a limit.
pub(super) fn shortened(
    before: &[f64],
    after: &[f64],
    parameter: Option<usize>,
    mut beyond: impl FnMut(&[f64]) -> bool,
) -> Vec<f64> {
    let at = |part: f64| -> Vec<f64> {
        let pairs = before.iter().zip(after).enumerate();
        pairs
            .map(|(p, (a, b))| match parameter.is_none_or(|of| of == p) {
                true => a + part * (b - a),
                false => *b,
            })
            .collect()
    };
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match beyond(&at(middle)) {
            true => high = middle,
            false => low = middle,
        }
    }
    at(PART * low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_before_the_limit() {
        let found = shortened(&[1.0, 5.0], &[-3.0, 6.0], Some(0), |v| v[0] < 0.0);
        assert!((found[0] - 0.1).abs() < 1e-4 && found[1] == 6.0, "{found:?}");
        let found = shortened(&[1.0, 5.0], &[-3.0, 6.0], None, |v| v[0] + v[1] < 4.0);
        assert!((found[0] + 1.4).abs() < 1e-3 && (found[1] - 5.6).abs() < 1e-3, "{found:?}");
        // Where it begins at a limit, it stays there.
        assert_eq!(shortened(&[0.0], &[-1.0], Some(0), |v| v[0] < 0.0), [0.0]);
    }
}
