//! Effects of a rig, in any order.

use super::*;

#[test]
fn effects_may_be_hidden_in_any_order() {
    let hidden = vec![
        ("sensor_lag", 0, vec![10.0]),
        ("const_leak", 1, vec![3.0]),
        ("pump_deadzone", 0, vec![0.5]),
    ];
    let built = |hidden| {
        let rig = Rig {
            hidden,
            ..Rig::cascaded_tanks()
        };
        rig.built().1
    };
    let turned = hidden.iter().rev().cloned().collect();
    assert_eq!(built(hidden), built(turned));
}
