use std::{path::Path, time::Instant};

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::effect::{Act, Input, Needs, Role, SensorRun};

const ENTRY: &str = r#"
[[effect]]
id = "gyr.cable_torque"
sensor = "gyr"
axes = "each"
formula = "sin(3 * inner) * tanh(a_y / s)"
unit = "rad/s"
amplitude = { typical = 1e-3, material = 2e-4 }
shape = { s = { typical = 3.0, low = 0.5, high = 10.0, unit = "m/s^2" } }
cause = "a cable that pulls at the inner gimbal"
remedy = "route it through the axis"
like = ["gyr.g_sensitivity"]
"#;

fn read_text(text: &str) -> Result<Vec<&'static Effect>, UserEffectError> {
    parse(text, Path::new("mine.toml"))
}

/// What is said of the entry with something replaced.
fn refusal(from: &str, to: &str) -> String {
    assert!(ENTRY.contains(from), "{from}");
    read_text(&ENTRY.replacen(from, to, 1)).expect_err(to).to_string()
}

/// Values of a formula on the x axis at some rows.
fn values(formula: &str, shapes: &[f64]) -> Vec<f64> {
    let names = ["p".to_owned(), "q".to_owned()];
    let expression = parser::parse(formula, &names).unwrap_or_else(|fault| panic!("{formula}: {fault}"));
    let mut input = Input::empty(3);
    for (row, input) in input.iter_mut().enumerate() {
        input.f_q = Vector3::new(1.0, -2.0, 0.5) * row as f64;
        input.angle_rates = [0.0, 0.25, 0.0];
        input.temperature = 20.0 + row as f64;
    }
    let rows = quantity::Rows { input: &input, sensed: &[], axis: 0 };
    let column = expression.column(&rows, shapes);
    (0..3).map(|row| column.at(row)).collect()
}

fn fault(formula: &str) -> FormulaFault {
    parser::parse(formula, &["p".to_owned()]).expect_err(formula)
}

#[test]
fn an_entry_becomes_an_effect_with_its_parameters_and_words() {
    let [effect] = read_text(ENTRY).unwrap()[..] else { panic!() };
    assert_eq!((&*effect.id, effect.sensors), ("gyr.cable_torque", &[crate::recording::SensorKind::Gyr][..]));
    let names: Vec<&str> = effect.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "z", "s"]);
    let (x, s) = (&effect.parameters[0], &effect.parameters[3]);
    assert_eq!((x.role, x.prior_scale, x.material, &*x.unit), (Role::Amplitude, 1e-3, 2e-4, "rad/s"));
    assert_eq!((s.role, s.range, &*s.unit), (Role::Shape { usual: 3.0 }, (0.5, 10.0), "m/s^2"));
    assert_eq!(effect.words.cause, "a cable that pulls at the inner gimbal");
    assert_eq!(effect.confusables[0].id, "gyr.g_sensitivity");
    assert_eq!(effect.needs, Needs::GIMBALS);
}

#[test]
fn equal_entries_are_one_effect_and_others_are_not() {
    let (one, again) = (read_text(ENTRY).unwrap()[0], read_text(&ENTRY.repeat(2)).unwrap());
    assert!(again.len() == 1 && std::ptr::eq(one, again[0]));
    let other = read_text(&ENTRY.replace("1e-3", "2e-3")).unwrap()[0];
    assert!(!std::ptr::eq(one, other));
    let twice = format!("{ENTRY}{}", ENTRY.replace("1e-3", "2e-3"));
    let message = read_text(&twice).unwrap_err().to_string();
    assert!(
        message.contains("mine.toml, line 14: effect `gyr.cable_torque`") && message.contains("line 2"),
        "{message}"
    );
}

#[test]
fn amplitudes_are_of_each_axis_or_common_or_of_some() {
    let added = |axes: &str, formula: &str, amplitudes: &[f64]| {
        let text = ENTRY.replace("\"each\"", axes).replace("\"sin(3 * inner) * tanh(a_y / s)\"", formula);
        let effect = read_text(&text).unwrap()[0];
        let Act::Formula(_, formula) = effect.act else { panic!() };
        let input = vec![Input { f_q: Vector3::new(1.0, 2.0, 3.0), ..Input::empty(1)[0] }];
        let mut output = [Vector3::zeros()];
        let values = [amplitudes, &[3.0]].concat();
        formula.add(&values, &mut SensorRun { input: &input, sensed: &[], output: &mut output }).unwrap();
        (output[0].x, output[0].y, output[0].z)
    };
    assert_eq!(added("\"each\"", "\"a * s\"", &[1.0, 0.0, 10.0]), (3.0, 0.0, 90.0));
    assert_eq!(added("\"common\"", "[\"a_z * s\", \"0\", \"a_x\"]", &[2.0]), (18.0, 0.0, 2.0));
    assert_eq!(added("[\"z\", \"x\"]", "\"a_y * s\"", &[1.0, -1.0]), (-6.0, 0.0, 6.0));
}

#[test]
fn formulas_mean_what_they_do_on_paper() {
    for (formula, expected) in [
        ("1 + 2 * 3", [7.0; 3]),
        ("-2^2", [-4.0; 3]),
        ("2^3^2 - 2**-1", [511.5; 3]),
        ("8 / 4 / 2 - 3 - 1", [-3.0; 3]),
        ("1.5e-3 + .5 + 2E2", [200.5015; 3]),
        ("min(a_x, max(a_y, -1))", [0.0, -1.0, -1.0]),
        ("(a_x > 0) * (a_x <= 1) + (t == 0)", [1.0, 1.0, 0.0]),
        ("a - a_x", [0.0; 3]),
        ("p * middle_rate + q", [2.5; 3]),
        ("sqrt(abs(-a_x * 4)) + sign(a_y)", [0.0, 1.0, libm::sqrt(8.0) - 1.0]),
        ("lag(temp, 1e-9) - mean(temp, 1e-9)", [0.0; 3]),
        ("cos(pi) + - - 1", [0.0; 3]),
    ] {
        for (found, expected) in values(formula, &[2.0, 2.0]).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{formula}: {found}");
        }
    }
}

#[test]
fn what_is_no_formula_is_refused_with_its_column() {
    for (formula, message) in [
        ("", "found the end at column 1, expected a number, a name or `(`"),
        ("a_x +", "found the end at column 6"),
        ("a_x a_y", "found `a` at column 5, expected an operator"),
        ("(a_x", "found the end at column 5, expected )"),
        ("a_x)", "found `)` at column 4"),
        ("1 < 2 < 3", "found `<` at column 7"),
        ("a_x = 1", "found `=` at column 5"),
        ("2x", "found `2x` at column 1, expected a finite number"),
        ("1e999", "found `1e999` at column 1"),
        (
            "a_xx",
            "found the name `a_xx` at column 1, expected an input, a shape of the entry or `pi`; did you mean `a_x`",
        ),
        ("velocity_of_the_robot", "use a_x, w_x"),
        ("sqr(t)", "did you mean `sqrt`"),
        ("system(t)", "the function `system`"),
        ("min(t)", "found 1 argument(s) of `min` at column 1, expected 2"),
        ("sin()", "found `)` at column 5"),
        ("lag(t, 0)", "no positive time"),
        ("mean(t, t)", "no positive time"),
        ("lag(t, -1)", "no positive time"),
        ("a_x; rm", "found `;` at column 4"),
        ("a_x \u{b7} 2", "found `\\u{b7}` at column 5"),
        ("{a}", "found `{` at column 1"),
    ] {
        let fault = fault(formula).to_string();
        assert!(fault.contains(message), "{formula}: {fault}");
    }
}

#[test]
fn bombs_are_refused_before_they_go_off() {
    let start = Instant::now();
    let nested = |open: &str, depth: usize| format!("{}t{}", open.repeat(depth), ")".repeat(depth));
    assert!(matches!(fault(&"(".repeat(999)), FormulaFault::TooDeep { .. }));
    assert!(matches!(fault(&nested("sin(", 100)), FormulaFault::TooDeep { .. }));
    assert!(matches!(fault(&"-".repeat(900)), FormulaFault::TooDeep { .. }));
    assert!(matches!(fault(&"2^".repeat(400)), FormulaFault::TooDeep { .. }));
    assert!(matches!(fault(&"t+".repeat(400)), FormulaFault::TooManyOperations { .. }));
    assert!(matches!(fault(&"t".repeat(1_000_000)), FormulaFault::TooLong { .. }));
    assert!(matches!(fault("lag(lag(lag(lag(t, 1), 1), 1), 1)"), FormulaFault::HistoryTooDeep { .. }));
    parser::parse(&nested("sin(", 20), &[]).unwrap();
    parser::parse(&format!("t{}", "+t".repeat(200)), &[]).unwrap();
    parser::parse("lag(t, 1) + lag(t, 2) + mean(t, 3) + mean(lag(t, p), p)", &["p".to_owned()]).unwrap();
    // Far above what it takes, far below what a bomb would.
    assert!(start.elapsed().as_secs() < 20);
}

#[test]
fn entries_of_nonsense_are_refused_with_line_and_key() {
    for (from, to, message) in [
        ("id = \"gyr.cable_torque\"", "id = \"gyr.bias\"", "that of an effect of the program"),
        (
            "id = \"gyr.cable_torque\"",
            "id = \"acc.cable_torque\"",
            "`id` is acc.cable_torque, expected the sensor",
        ),
        ("id = \"gyr.cable_torque\"", "id = \"gyr.Cable\\u001b[31m\"", "`id` is gyr.Cable\\u{1b}[31m"),
        ("sensor = \"gyr\"", "sensor = \"sonar\"", "`sensor` is sonar, expected acc, gyr or mag"),
        ("sensor = \"gyr\"", "", "missing field `sensor`"),
        ("unit = \"rad/s\"", "unit = \"\"", "`unit` is , expected"),
        ("remedy", "remedyy", "unknown field `remedyy`"),
        ("cause = \"a cable", "cause = \"a\\ncable", "`cause` is a\\ncable"),
        ("typical = 1e-3", "typical = nan", "`amplitude.typical` is NaN, expected a positive number"),
        ("typical = 1e-3", "typical = 0", "`amplitude.typical` is 0"),
        ("typical = 1e-3", "typical = \"big\"", "invalid type"),
        ("material = 2e-4", "material = -2e-4", "`amplitude.material` is -0.0002"),
        ("material = 2e-4", "material = inf", "`amplitude.material` is inf"),
        ("low = 0.5", "low = 5.0", "`shape.s` is 5 <= 3 <= 10, expected"),
        ("low = 0.5", "low = 0.0", "`shape.s.low` is 0, expected a number above zero"),
        ("high = 10.0", "high = inf", "`shape.s` is 0.5 <= 3 <= inf"),
        ("shape = { s", "shape = { a_y", "`shape` is a_y, expected a name"),
        ("a_y / s)", "a_y)", "the shape `s` is not in the formula"),
        ("\"each\"", "\"every\"", "`axes` is every, expected"),
        ("\"each\"", "[\"x\", \"x\"]", "`axes` is [x, x]"),
        ("\"each\"", "[]", "`axes` is []"),
        ("axes = \"each\"", "axes = 3", "`axes` to be"),
        ("like = [\"gyr.g_sensitivity\"]", "like = [\"gyr.g_sensitivty\"]", "`like` is gyr.g_sensitivty"),
        ("like = [\"gyr.g_sensitivity\"]", "like = [\"gyr.cable_torque\"]", "`like` is gyr.cable_torque"),
        ("[[effect]]", "[effects]", "unknown field `effects`"),
        ("[[effect]]", "[[effect]", "mine.toml, line 2: found"),
        ("sin(3 * inner)", "sin(3 * iner)", "did you mean `inner`"),
    ] {
        let text = refusal(from, to);
        assert!(text.starts_with("mine.toml, line ") && text.contains(message), "{to}: {text}");
    }
    assert!(read_text("effect = []").unwrap_err().to_string().contains("found 0 effects"));
    assert!(read_text("").unwrap_err().to_string().contains("missing field `effect`"));
    let many: String = (0..201).map(|k| ENTRY.replace("cable_torque", &format!("cable_{k}"))).collect();
    assert!(read_text(&many).unwrap_err().to_string().contains("found 201 effects, expected 1 to 200"));
}

#[test]
fn a_time_that_is_a_shape_must_be_positive() {
    let lagged = ENTRY.replace("tanh(a_y / s)", "lag(a_y, s)");
    assert!(read_text(&lagged).is_ok());
    let message = read_text(&lagged.replace("low = 0.5", "low = -0.5")).unwrap_err().to_string();
    assert!(message.contains("a time of lag or mean"), "{message}");
}

#[test]
fn a_file_that_is_no_text_or_is_not_there_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let message = || read(&path, &Limits::default()).unwrap_err().to_string();
    assert!(message().contains("mine.toml: cannot be read"), "{}", message());
    std::fs::write(&path, [b'\n', 0xff, 0xfe]).unwrap();
    assert!(message().contains("line 2: found bytes that are no UTF-8"), "{}", message());
    std::fs::write(&path, ENTRY).unwrap();
    assert_eq!(read(&path, &Limits::default()).unwrap().len(), 1);
}

#[test]
fn a_value_that_is_not_finite_is_an_error_with_its_row() {
    let effect = read_text(&ENTRY.replace("sin(3 * inner) * tanh(a_y / s)", "s / (t - 0.02)")).unwrap()[0];
    let Act::Formula(_, formula) = effect.act else { panic!() };
    let input = Input::empty(5);
    let mut output = vec![Vector3::zeros(); 5];
    let mut run = SensorRun { input: &input, sensed: &[], output: &mut output };
    let message = formula.add(&[0.0, 1.0, 0.0, 3.0], &mut run).unwrap_err().to_string();
    assert!(
        message.contains("gyr.cable_torque: found inf") && message.contains("axis y in row 3 (t = 0.02 s)"),
        "{message}"
    );
    assert!(message.contains("`s / (t - 0.02)`"), "{message}");
    // An axis without an amplitude is not asked.
    formula.add(&[0.0, 0.0, 0.0, 3.0], &mut run).unwrap();
}

proptest! {
    #[test]
    fn no_text_is_too_odd_to_be_answered(formula in "[-+*/^()<>=., a-z_0-9]{0,60}") {
        if let Ok(expression) = parser::parse(&formula, &["s".to_owned()]) {
            let input = Input::empty(4);
            let sensed = vec![Vector3::zeros(); 4];
            expression.column(&quantity::Rows { input: &input, sensed: &sensed, axis: 2 }, &[1.0]);
        }
    }

    #[test]
    fn no_file_is_too_odd_to_be_answered(cut in 0..600usize, odd in "\\PC{0,8}") {
        let text: String = ENTRY.chars().take(cut).chain(odd.chars()).chain(ENTRY.chars().skip(cut)).collect();
        let _ = read_text(&text);
    }
}

#[test]
fn only_what_the_catalogue_or_the_file_holds_is_known() {
    let ids = |id: &str| known(&[id.to_owned()], &[]);
    assert_eq!(ids("acc.misalignment"), Ok(vec!["acc.misalignment".to_owned()]));
    let unknown = ids("acc.misalinment").unwrap_err().to_string();
    assert!(unknown.contains("no effect or term") && unknown.contains("did you mean `acc.misalignment`"));
}
