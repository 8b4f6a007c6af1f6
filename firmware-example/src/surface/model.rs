//! Models: rows, costs, and what their parameters stand for.

use imucal_core::{
    model::{
        self, Cost, Model, RowSink, SquaredSum,
        alignment::Alignment,
        attitude::AttitudeModel,
        dip::{DipModel, DirectionPair, RELABELLINGS},
        norm::NormModel,
        parameterisation::{FULL, FULL_WITH_SENSITIVITY, UPPER_TRIANGULAR},
        rig::{Axis, GimbalPose, Pose, ReferencePose, RigAxes},
        thermal::{Side, ThermalForm, UPPER_TRIANGULAR_LINEAR},
        turn::TurnModel,
        unified::{Terms, UNIFIED, UnifiedModel, UnifiedParameters},
    },
    observation::{Block, BlockBuilder, Compared, Durations, Motion, ShellPoint, Turn},
    triad::Triad,
};
use nalgebra::{Quaternion, SMatrix, SVector, Vector3};

use crate::scene;

#[inline(never)]
pub(super) fn reach_all() {
    forms();
    norm();
    thermal();
    let block = block();
    turns(&block);
    attitudes(&block);
    dip();
    poses();
    parameters();
    unified();
}

/// The sum of a model's squares, by its rows.
fn none() -> SquaredSum<f32> {
    SquaredSum(0.0)
}

#[inline(never)]
fn forms() {
    let truth = scene::gyroscope().truth;
    let theta: SVector<f32, 21> =
        reach!(model::parameterisation::Parameterisation::theta(&FULL_WITH_SENSITIVITY, &truth));
    reach!(model::parameterisation::Parameterisation::triad(&FULL_WITH_SENSITIVITY, &theta));
    reach!(model::parameterisation::Parameterisation::sensitivity(&FULL_WITH_SENSITIVITY, &theta));
    reach!(model::parameterisation::Parameterisation::has_sensitivity(&FULL));
    reach!(model::parameterisation::Parameterisation::entries(&FULL));
    reach!(model::parameterisation::Parameterisation::select(&FULL, &theta));
}

#[inline(never)]
fn norm() {
    let points = [ShellPoint::new(Vector3::new(1.0f32, 2.0, 9.0))];
    let theta = UPPER_TRIANGULAR.theta(&Triad::identity());
    let shell = NormModel { points: &points, norm: 9.8, form: UPPER_TRIANGULAR };
    let mut sum = none();
    reach!(model::norm::NormModel::rows(&shell, &theta, &mut sum));
    reach!(model::norm::NormModel::independent_rows(&shell));
    reach!(model::norm::curvature_excess(&Triad::identity(), 9.8f32, &Vector3::new(0.0, 0.0, 9.0), 1e-4));
    reach!(model::SquaredSum::row(&mut sum, 0.5f32, &theta));
}

#[inline(never)]
fn thermal() {
    let form: ThermalForm<12, 15> =
        reach!(model::thermal::ThermalForm::new(*UPPER_TRIANGULAR_LINEAR.entries(), Side::Gain));
    reach!(model::thermal::ThermalForm::entries(&form));
    let cold = FULL.theta(&scene::gyroscope().truth);
    let theta: SVector<f32, 15> = reach!(model::thermal::ThermalForm::theta(&form, &cold));
    let _cold: SVector<f32, 12> = reach!(model::thermal::ThermalForm::cold(&form, &theta));
    reach!(model::thermal::ThermalForm::terms(&form, &theta, 25.0));
}

fn block() -> Block<f32> {
    let mut builder = BlockBuilder::default();
    builder.push(&Vector3::new(0.3, -0.2, 0.1), 0.02);
    builder.finish().0
}

#[inline(never)]
fn turns(block: &Block<f32>) {
    let (blocks, theta) = ([*block], FULL.theta(&Triad::identity()));
    let turn = Turn {
        blocks: &blocks,
        durations: Durations::Uniform(0.02),
        before: Vector3::x(),
        after: Vector3::z(),
    };
    reach!(model::turn::attitude(&Triad::identity(), &turn));
    let carrier = reach!(model::turn::Carrier::new(&Triad::identity()));
    let mut attitude = nalgebra::Matrix3::<f32>::identity();
    reach!(model::turn::Carrier::carry(&carrier, &mut attitude, block, 0.02));
    reach!(model::turn::Carrier::carry_with_derivative(&carrier, &mut attitude, block, 0.02));
    reach!(model::turn::Carrier::vector(&carrier, block, 0.02));
    let turns = [turn];
    let carried = TurnModel { turns: &turns, form: FULL };
    reach!(model::turn::TurnModel::rows(&carried, &theta, &mut none()));
    reach!(model::turn::TurnModel::independent_rows(&carried));
    let mut pass = reach!(model::turn::TurnModel::begin(&carried, &theta));
    reach!(model::turn::TurnModel::advance(&carried, &theta, &mut pass, &mut 3));
    reach!(model::Cost::cost(&carried, &theta));
}

#[inline(never)]
fn attitudes(block: &Block<f32>) {
    let (blocks, references) = ([*block], [Quaternion::identity()]);
    let (earth, force) = ([Vector3::x()], [Vector3::z()]);
    let motions = [Motion {
        blocks: &blocks,
        durations: Durations::Uniform(0.02),
        earth: &earth,
        force: &force,
        start: Quaternion::identity(),
        references: &references,
        compared: Compared::Every(1),
    }];
    let theta = FULL_WITH_SENSITIVITY.theta(&Triad::identity());
    let integrated = AttitudeModel { motions: &motions, form: FULL_WITH_SENSITIVITY };
    reach!(model::attitude::AttitudeModel::rows(&integrated, &theta, &mut none()));
    reach!(model::attitude::AttitudeModel::independent_rows(&integrated));
    let mut pass = reach!(model::attitude::AttitudeModel::begin(&integrated, &theta));
    reach!(model::attitude::AttitudeModel::advance(&integrated, &theta, &mut pass, &mut 3));
}

#[inline(never)]
fn dip() {
    let pairs = [DirectionPair { u_f: Vector3::x(), u_b: Vector3::z() }];
    let dip = DipModel { pairs: &pairs };
    reach!(model::dip::DipModel::rows(&dip, &SVector::from([0.1f32, 0.2, 0.3, 0.9]), &mut none()));
    reach!(model::dip::DipModel::independent_rows(&dip));
    alignment(&pairs);
}

#[inline(never)]
fn alignment(pairs: &[DirectionPair<f32>]) {
    let phi: Vector3<f32> = reach!(model::dip::relabelling(RELABELLINGS[9]));
    reach!(model::dip::is_lower(1.0f32, 2.0));
    let theta = SVector::from([phi.x, phi.y, phi.z, 0.2]);
    let inverse = SMatrix::identity();
    let turn = reach!(model::alignment::Alignment::new(
        pairs.iter().copied(),
        50.0,
        &theta,
        &(inverse * 1e-6),
        &inverse
    ));
    let turn: Alignment<f32> = turn;
    let triad = Triad::identity();
    reach!(model::alignment::Alignment::error(&turn));
    reach!(model::alignment::Alignment::turned(&turn, &triad));
    reach!(model::alignment::Alignment::followed(&turn, &triad, &triad.gain, &triad));
    reach!(model::alignment::Alignment::errors(&turn, &triad, &[triad; 2], &SMatrix::identity()));
}

const AXES: RigAxes = RigAxes([Axis::Z, Axis::Y, Axis::X]);

#[inline(never)]
fn poses() {
    let angles = Vector3::new(0.1f32, -0.2, 1.3);
    let pose = reach!(model::rig::GimbalPose::new(Vector3::z(), &angles));
    reach!(model::rig::GimbalPose::turned(Vector3::z(), angles, angles));
    reach!(model::rig::GimbalPose::angles(&pose));
    let _wide: GimbalPose<f64> = reach!(model::rig::GimbalPose::cast(&pose));
    reach!(model::rig::GimbalPose::value(&pose));
    reach!(model::rig::GimbalPose::rotations(&pose, &AXES));
    let pose = ReferencePose { value: Vector3::z(), attitude: Quaternion::<f32>::identity() };
    let _wide: ReferencePose<f64> = reach!(model::rig::ReferencePose::cast(&pose));
    reach!(model::rig::ReferencePose::value(&pose));
    reach!(model::rig::ReferencePose::rotations(&pose, &()));
}

fn terms() -> Terms<14> {
    reach!(model::unified::Terms::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]))
}

#[inline(never)]
fn parameters() {
    let base: UnifiedParameters<f32> =
        reach!(model::unified::UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -9.8)));
    let all: SVector<f32, UNIFIED> = reach!(model::unified::UnifiedParameters::to_vector(&base));
    reach!(model::unified::UnifiedParameters::from_vector(&all));
    let rotations = GimbalPose::new(Vector3::z(), &Vector3::new(0.1f32, -0.2, 1.3)).rotations(&AXES);
    reach!(model::unified::UnifiedParameters::predict(&base, &rotations));
    let terms = terms();
    let theta: SVector<f32, 14> = reach!(model::unified::Terms::theta(&terms, &base));
    reach!(model::unified::Terms::parameters(&terms, &base, &theta));
    reach!(model::unified::Terms::entries(&terms));
    reach!(model::unified::Terms::class(&terms, 99));
}

#[inline(never)]
fn unified() {
    let poses = [GimbalPose::new(Vector3::z(), &Vector3::new(0.1f32, -0.2, 1.3))];
    let base = UnifiedParameters::nominal(Vector3::new(0.0, 0.0, -9.8));
    let rig = UnifiedModel { poses: &poses, axes: AXES, base, terms: terms(), held: 5 };
    reach!(model::unified::UnifiedModel::rows(&rig, &terms().theta(&base), &mut none()));
    reach!(model::unified::UnifiedModel::independent_rows(&rig));
}
