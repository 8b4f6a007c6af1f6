use std::collections::BTreeSet;

use super::*;

/// The contract's list, families spelt `P.`, and what was added to it.
const CONTRACT: &str = "ref.motion_mismatch ref.mount_slip ref.attitude_noise ref.position_noise rig.level_tilt rig.heading P.bias P.scale P.misalignment acc.gravity_error \
    rig.encoder_harmonic rig.encoder_offset rig.axis_nonorthogonality rig.wobble clk.time_offset clk.rate_error \
    P.scale_quadratic P.scale_cubic P.scale_asymmetry P.cross_axis_product P.temp_bias P.temp_bias_quadratic \
    P.temp_scale P.warmup P.bias_drift P.bias_step P.saturation P.bandwidth P.stuck_samples P.noise_burst \
    P.axis_swap P.unit_error acc.lever_arm acc.inner_lever_arm acc.vibration_rectification acc.hysteresis \
    gyr.hysteresis gyr.g_sensitivity gyr.g2_sensitivity gyr.angular_acceleration gyr.earth_rate \
    mag.gimbal_hard_iron_outer mag.gimbal_hard_iron_middle mag.gimbal_soft_iron_outer mag.gimbal_soft_iron_middle \
    mag.motor_current mag.eddy_current mag.field_drift mag.transient mag.field_gradient mag.hard_iron mag.soft_iron \
    mag.field_direction clk.jump clk.wander";

fn contract() -> BTreeSet<String> {
    CONTRACT
        .split_whitespace()
        .flat_map(|id| match id.strip_prefix("P.") {
            Some(name) => SensorKind::ALL.map(|kind| member_id(kind, name)).to_vec(),
            None => vec![id.to_owned()],
        })
        .collect()
}

#[test]
fn the_catalogue_is_the_contract_s_list_each_id_once() {
    let ids: BTreeSet<String> = CATALOGUE.iter().map(|effect| effect.id.clone()).collect();
    assert_eq!(ids.len(), CATALOGUE.len());
    assert_eq!(ids, contract());
}

#[test]
fn the_catalogue_stands_in_the_order_of_the_chain() {
    assert!(CATALOGUE.is_sorted_by_key(|effect| effect.act.stage()));
}

#[test]
fn triads_are_altered_before_anything_reads_their_output() {
    let sensor = CATALOGUE.iter().filter(|effect| effect.act.stage() == Stage::Sensor);
    assert!(sensor.map(|effect| !matches!(effect.act, Act::Triad(..))).is_sorted());
}

#[test]
fn every_effect_says_what_it_is_and_every_parameter_what_it_measures() {
    for effect in CATALOGUE.iter() {
        let words = effect.words;
        for text in [words.cause, words.remedy, words.needs] {
            assert!(text.len() > 15 && text.ends_with('.'), "{}: {text:?}", effect.id);
        }
        let names: BTreeSet<_> = effect.parameters.iter().map(|parameter| &parameter.name).collect();
        assert_eq!(names.len(), effect.parameters.len(), "{}", effect.id);
        assert!(effect.parameters.iter().any(Parameter::switches), "{}", effect.id);
        for p in &effect.parameters {
            assert!(!p.name.is_empty() && !p.unit.is_empty(), "{}", effect.id);
            assert!(p.prior_scale > 0.0 && p.range.0 < p.range.1, "{}: {}", effect.id, p.name);
            assert!(
                !p.switches() || (p.material > 0.0 && p.prior_scale <= p.range.1),
                "{}: {}",
                effect.id,
                p.name
            );
            assert!((p.range.0..=p.range.1).contains(&p.neutral(100.0)), "{}: {}", effect.id, p.name);
        }
    }
}

#[test]
fn every_effect_names_one_that_looks_alike_and_what_parts_them() {
    for effect in CATALOGUE.iter() {
        assert!(!effect.confusables.is_empty(), "{}", effect.id);
        for other in &effect.confusables {
            let known = match other.id.strip_prefix("P.") {
                Some(name) => SensorKind::ALL.iter().all(|kind| find(&member_id(*kind, name)).is_some()),
                None => find(&other.id).is_some(),
            };
            assert!(
                known && other.id != effect.id && !other.parted_by.is_empty(),
                "{}: {}",
                effect.id,
                other.id
            );
        }
    }
}
