use super::*;

#[test]
fn each_source_has_a_preset_and_the_default_is_a_rig_s() {
    let [rig, reference, simulator, rests] =
        [Source::Rig, Source::Reference, Source::Simulator, Source::Rests].map(Settings::preset);
    assert_eq!(Settings::default(), rig);
    assert!(rig.source.gimbals && !reference.source.gimbals && !rests.source.heading);
    // Evidence alone decides where the noise model is right: on a rig.
    let confirmed = |settings: &Settings| settings.verdict.confirms_held_out;
    assert_eq!([&rig, &reference, &simulator, &rests].map(confirmed), [false, true, true, true]);
}
