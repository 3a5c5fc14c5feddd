//! The acceptance run: every step that a set asks for passes on the simulated axis.

use params::AxisSet;
use params::acceptance::{Outcome, active, trial};

/// The steps of a set, those that fell short as text, and what is not proven.
struct Run {
    steps: Vec<String>,
    short: Vec<String>,
    open: Vec<String>,
}

fn set(text: &str) -> AxisSet {
    let mut machine = params::parse(text, "set.toml").unwrap_or_else(|all| panic!("{all:#?}"));
    machine.axes.remove(0)
}

fn run(text: &str) -> Run {
    let report = params::check(text, "set.toml");
    assert!(report.passed(), "{:#?}", report.findings);
    let set = set(text);
    let trials = trial::trials(&set);
    let open = active::unproven(&set, &trials).into_iter().map(|open| open.function).collect();
    let outcomes: Vec<_> =
        trials.into_iter().map(|trial| sim::acceptance::run(&set, trial).expect("runs")).collect();
    let short = outcomes.iter().filter(|outcome| outcome.passed() != Some(true)).map(fallen).collect();
    Run { steps: outcomes.into_iter().map(|outcome| outcome.trial.function).collect(), short, open }
}

fn fallen(outcome: &Outcome) -> String {
    let trial = &outcome.trial;
    let pairs = trial.expectations.iter().zip(&outcome.measured);
    let wrong = pairs.filter(|(_, measured)| !measured.right).map(|(expected, measured)| {
        format!("\n    {} ({}): {:?} {}", expected.what, expected.when(), measured.t_ms, measured.text)
    });
    format!("{} {}{}\n", trial.function, trial.action, wrong.collect::<String>())
}

/// Every step passes, everything active has one, and these functions are among them.
fn proves(text: &str, functions: &[&str]) {
    let run = run(text);
    assert!(run.short.is_empty(), "{}", run.short.concat());
    assert!(run.open.is_empty(), "not proven: {:?}", run.open);
    for function in functions {
        assert!(run.steps.iter().any(|step| step == function), "{function} has no step: {:?}", run.steps);
    }
}

const AMK: &str = "profile = \"amk-kw\"\n[parameters]\nPrm67 = 3000\nPrm2 = 400\nPrm3 = 320\nPrm9 = 1\nPrm10 = 1\nPrm18 = 50\nPrm20 = 800\nPrm21 = 20\nPrm25 = 900\nPrm26 = 10\nPrm28 = 5\nPrm33 = 900\nPrm34 = 300\nPrm57 = 500\nPrm58 = 1\nPrm62 = 1200\nPrm64 = 10\nPrm65 = 30000\nPrm66 = -30000\n";

/// AMK-VAL-03: every function of the set is proved on its own limits.
#[test]
fn every_function_of_an_amk_set_commanded_by_the_fieldbus_is_proven() {
    proves(AMK, &["STO", "SS1", "SS2", "SOS", "SSR4", "SLS2", "SDIp", "SLI", "SMS", "SEM", "SE3", "SA2"]);
    proves(&format!("{AMK}Prm8 = 0\n"), &["SA1", "SA2"]);
}

/// AMK-IN-01, AMK-IN-05, AMK-IN-06
#[test]
fn every_function_of_an_amk_set_commanded_by_inputs_is_proven() {
    let by_inputs = format!("{AMK}Prm7 = 1\nPrm15 = 12\nPrm16 = 4\nPrm17 = 1\n");
    proves(&by_inputs, &["SLS1", "SSR1", "SS1", "SE1", "SE2", "SE3", "SA1", "SA2"]);
    let stops = format!("{AMK}Prm7 = 1\nPrm15 = 3\nPrm16 = 14\nPrm17 = 0\nPrm76 = 1\n");
    proves(&stops, &["SOS", "SLI", "STO", "SE1", "SE2", "SE3"]);
}

const ETG: &str = "profile = \"etg-6100-2\"\n[parameters]\nSS1_1.time_to_sto = 500\nSS1_2.time_to_sto = 400\nSS1_2.deceleration_limit = 5000\nSS1_2.time_delay_deceleration_monitoring = 50\nSS2_1.time_to_sos = 600\nSS2_1.error_reaction = \"SS1_1\"\nSS2_1.deceleration_limit = 4000\nSS2_1.time_delay_deceleration_monitoring = 20\nSLS_1.velocity_limit = 400\nSLS_2.velocity_limit = 700\nSLS_2.time_to_velocity_monitoring = 200\nSLS_2.error_reaction = \"SS1_1\"\nSLS_3.velocity_limit = 300\nSLS_3.error_reaction = \"none\"\nSLS_4.velocity_limit = 800\nSLS_4.time_to_velocity_monitoring = 900\nSLS_4.deceleration_limit = 2000\nSLS_4.error_reaction = \"SS2_1\"\nSLS_5.velocity_limit = 90\nSSR_1.velocity_upper_limit = 600\nSSR_1.velocity_lower_limit = 200\nSSR_2.velocity_upper_limit = 100\nSSR_2.velocity_lower_limit = -50\nSOS_1.position_zero_window = 500\nSOS_2.position_zero_window = 9000\nSOS_2.velocity_zero_window = 5\nSMS.velocity_maximum_positive = 1500\nSMS.velocity_maximum_negative = 1400\nSDI.position_zero_window = 300\nSLI_1.position_relative_upper_limit = 5000\nSLI_1.position_relative_lower_limit = 2000\nSLI_2.position_relative_upper_limit = 1\nSLI_2.position_relative_lower_limit = 0\nSLP_1.position_upper_limit = 100000\nSLP_1.position_lower_limit = -20000\nSLP_2.position_upper_limit = 900000\nSLP_2.position_lower_limit = 800000\nSLP_2.error_reaction = \"SS1_2\"\nSLT_1.torque_limit_positive_direction = 500\nSLT_1.torque_limit_negative_direction = 300\nSAR_1.acceleration_upper_limit = 4000\nSAR_1.acceleration_lower_limit = -3000\nSSM_1.velocity_upper_limit = 10\nSSM_1.velocity_lower_limit = -10\nSSM_2.velocity_upper_limit = 500\nSSM_2.velocity_lower_limit = 300\nSCA_1.position_upper_limit = 50000\nSCA_1.position_lower_limit = -1000\nSCA_2.position_upper_limit = 90000\nSCA_2.position_lower_limit = 80000\nSBC_1.brake_time_delay = 30\n[words]\ncontrol.40 = \"SLS_5\"\nstatus.41 = \"SLS_5\"\n";

#[test]
fn every_instance_of_a_generic_set_is_proven() {
    let functions = [
        "STO", "SS1_2", "SS2_1", "SOS_2", "SLS_3", "SLS_4", "SLS_5", "SSR_2", "SMS", "SDIP", "SDIN", "SLI_2",
        "SLP_2", "SLT_1", "SAR_1", "SSM_2", "SCA_2", "SBC_1",
    ];
    proves(ETG, &functions);
    // Nothing may decelerate, so that the acceleration has a set of its own.
    let acceleration = "SMA.acceleration_maximum = 9000\nSMA.deceleration_maximum = 0\n";
    proves(&format!("profile = \"etg-6100-2\"\n[parameters]\n{acceleration}"), &["SMA"]);
}

const LENZE: &str = "profile = \"lenze-sm301\"\n[parameters]\nC15111 = 5\nC15305 = 600\nC15310 = 20\nC15311 = 400\nC15320 = 3000\n\"C15330/1\" = 500\n\"C15331/1\" = 400\n\"C15330/2\" = 1500\n\"C15332/2\" = 1\n";

#[test]
fn every_function_of_a_lenze_set_is_proven() {
    proves(
        &format!("{LENZE}C15205 = 1\n"),
        &["STO", "SSE", "SS1", "SS2", "SOS", "SLS1", "SLS2", "SDIneg", "SMS"],
    );
    // LNZ-OMS-02, LNZ-OMS-03, LNZ-ES-03, LNZ-SLI-02
    let special = "C15200 = 2\nC15201 = 3\nC15203 = 5000\nC15315 = 1\n\"C15051/1\" = 1\n";
    proves(&format!("{LENZE}{special}"), &["OMS", "ES", "SLI", "SS1", "SD-Out1"]);
}

/// LNZ-IN-01, LNZ-OMS-11, LNZ-ES-02
#[test]
fn every_input_of_a_lenze_set_is_proven() {
    let inputs = "C15113 = 0xFFFFF5FF\nC15203 = 4000\n\"C15030/1\" = 2\n\"C15031/1\" = 1\n\"C15030/2\" = 2\n\"C15031/2\" = 2\n\"C15030/3\" = 2\n\"C15031/3\" = 3\n\"C15030/4\" = 2\n\"C15032/4\" = 3\n\"C15034/4\" = 20\n\"C15033/4\" = 50\n";
    proves(&format!("{LENZE}{inputs}"), &["SD-In1", "SD-In2", "SD-In3", "SD-In4", "OMS", "ES", "SLI", "SSE"]);
}

/// LNZ-CAS-01, LNZ-CAS-09, LNZ-CAS-10
#[test]
fn a_cascade_is_proven() {
    let cascade = "C15035 = 4\nC15113 = 0xFEFFFFFF\n\"C15030/4\" = 2\n\"C15031/4\" = 1\nC15200 = 2\n";
    proves(&format!("{LENZE}{cascade}"), &["cascade", "STO", "SSE", "ES"]);
}

const ATV: &str = "profile = \"atv340\"\n[parameters]\nSC01 = \"Asynchronous Motor\"\nSC02 = 2\nSC05 = \"SinCos embedded\"\nSC06 = 1024\nSC68 = 7\nSC65 = \"Safety function used via fieldbus\"\nSC30 = 60.0\nSC31 = 50.0\nSC32 = 3.0\nSC33 = 1.0\nSC34 = 100\nSC36 = \"Automatic\"\nSC66 = \"Safety function used via fieldbus\"\nSC50 = 10.0\nSC48 = 12.0\n";

/// ATV-SLST1-02 to ATV-SLST6-01, ATV-SMS-03 to ATV-SMS-08
#[test]
fn every_type_of_sls_and_mode_of_sms_of_an_atv_set_is_proven() {
    let one = "SC56 = \"1 threshold\"\nSC57 = 40.0\nSC58 = 40.0\n";
    let two = "SC56 = \"2 thresholds\"\nSC57 = 40.0\nSC58 = 40.0\nSC59 = 30.0\nSC60 = 30.0\n";
    let maintenance = "SC56 = \"Maintenance\"\nSC57 = 40.0\nSC58 = 40.0\n";
    let ramp = "SC40 = 60.0\nSC41 = 60.0\nSC43 = 2.0\n";
    let standstill = "SC46 = 2.0\nSC54 = 300\n";
    for (kind, sms) in [(1, one), (2, two), (3, maintenance), (4, one), (5, one), (6, two)] {
        let ramp = if kind == 1 { "" } else { ramp };
        let standstill = if kind < 4 { standstill } else { "" };
        let set = format!("{ATV}SC39 = \"SLS Type {kind}\"\n{ramp}{standstill}{sms}");
        proves(&set, &["STO", "SS1", "SLS", "SMS"]);
    }
}

/// A new file is safe on purpose, and its steps pass as they are.
#[test]
fn the_delivery_state_passes_its_own_steps() {
    // Two minutes of standstill instead of two hours.
    proves("profile = \"amk-kw\"\n[parameters]\nPrm9 = 1\nPrm10 = 1\n", &["STO", "SMS"]);
    proves("profile = \"atv340\"\n", &["STO"]);
    proves("profile = \"etg-6100-2\"\n", &["STO"]);
    proves("profile = \"lenze-sm301\"\n", &["STO", "SMS"]);
}

/// A run that cannot fall short would prove nothing.
#[test]
fn a_limit_that_is_not_the_one_expected_falls_short() {
    let of = |limit: u32| {
        set(&format!(
            "profile = \"amk-kw\"\n[parameters]\nPrm67 = 3000\nPrm2 = 400\nPrm3 = 320\nPrm57 = {limit}\n"
        ))
    };
    let mut trials = trial::trials(&of(500)).into_iter();
    let expected = trials.find(|trial| trial.function == "SLS1").expect("a step");
    let passed = |limit| sim::acceptance::run(&of(limit), expected.clone()).expect("runs").passed();
    assert_eq!([499, 500, 501].map(passed), [Some(false), Some(true), Some(false)]);
}
