//! Choices between parts of a BSDF.

/// Whether a number of (0, 1) chooses the first of two parts, whose probabilities are given, and the number stretched to
/// (0, 1) again.
pub(super) fn choose(choice: f64, [first, second]: [f64; 2]) -> (bool, f64) {
    // Not 1, which no choice is.
    let most = 1.0 - 0.5 * f64::EPSILON;
    if choice < first {
        (true, (choice / first).min(most))
    } else {
        (false, ((choice - first) / second).clamp(f64::MIN_POSITIVE, most))
    }
}
