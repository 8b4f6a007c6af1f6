//! A turn that is none: what it carries stays where it was.

use imucal_core::{
    model::{Cost, Model, SquaredSum, parameterisation::FULL, turn::TurnModel},
    observation::{BlockBuilder, Durations, Turn},
    triad::Triad,
};
use nalgebra::Vector3;

/// |before − after|², by the rows and by the cost: nothing turns.
fn squared(before: Vector3<f64>, after: Vector3<f64>) -> [f64; 2] {
    let mut builder = BlockBuilder::default();
    (0..4).for_each(|_| builder.push(&Vector3::zeros(), 0.01));
    let (block, duration) = builder.finish();
    let blocks = [block];
    let turns = [Turn { blocks: &blocks, durations: Durations::Uniform(duration), before, after }];
    let (carried, theta) = (TurnModel { turns: &turns, form: FULL }, FULL.theta(&Triad::identity()));
    let mut sum = SquaredSum(0.0);
    carried.rows(&theta, &mut sum);
    [sum.0, carried.cost(&theta)]
}

#[test]
fn a_sensor_at_rest_finds_the_vector_where_it_was() {
    assert_eq!(squared(Vector3::z(), Vector3::z()), [0.0, 0.0]);
    assert_eq!(squared(Vector3::z(), -Vector3::z()), [4.0, 4.0]);
    assert_eq!(squared(Vector3::z(), Vector3::x()), [2.0, 2.0]);
}
