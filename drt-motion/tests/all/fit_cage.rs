//! The example that fits a cage arrives.

#[path = "../../examples/fit_cage.rs"]
#[allow(unreachable_pub, reason = "an example is a crate of its own")]
mod example;

#[test]
fn the_cage_is_found() {
    let fitted = example::fit().unwrap();
    assert!(fitted.cage[0] > 0.1, "the cage moves: {}", fitted.cage[0]);
    let left = [fitted.cage, fitted.body].map(|[before, after]| after / before);
    assert!(left.iter().all(|l| *l < 0.02), "{left:?} of the distances remain");
}
