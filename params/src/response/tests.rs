use super::*;

fn set(text: &str) -> AxisSet {
    crate::parse(text, "x").unwrap_or_else(|errors| panic!("{errors:#?}")).axes.remove(0)
}

fn total(chains: &[Chain], name: &str) -> String {
    let chain = chains.iter().find(|chain| chain.name == name);
    ms(chain.unwrap_or_else(|| panic!("{name}")).total_us)
}

fn amk_of(first: u32, second: u32, around: Surroundings) -> Vec<Chain> {
    let text = format!(
        "profile = \"amk-kw\"\n[parameters]\nPrm83 = {first}\nPrm85 = {second}\nPrm84 = 64000\nPrm86 = 63000"
    );
    chains(&set(&text), &around)
}

/// AMK-EX-T-IN-MIN, AMK-EX-T-IN-ASYM, AMK-EX-T-IN-MAX
#[test]
fn amk_input_chains_follow_the_examples() {
    let sensor = |sensor: u64| Surroundings { sensor, ..Surroundings::default() };
    for (first, second, around, active, sto) in [
        (250, 250, sensor(0), "0.5", "2.5"),
        (1_000, 2_000, sensor(5_000), "7.25", "9.25"),
        (65_500, 65_500, sensor(0), "65.75", "67.75"),
    ] {
        let chains = amk_of(first, second, around);
        assert_eq!(
            (total(&chains, "SE3 to function"), total(&chains, "SE3 to STO")),
            (active.into(), sto.into())
        );
    }
}

/// AMK-EX-T-FSOE, AMK-TIME-04
#[test]
fn amk_bus_and_output_chains_follow_the_examples() {
    let around = Surroundings { sensor: 5_000, controller: 10_000, bus: 16_000, ..Surroundings::default() };
    let chains = amk_of(1_000, 1_000, around);
    assert_eq!(total(&chains, "FSoE to function"), "46");
    assert_eq!(total(&chains, "function to SA1"), "2.4");
    let sampled = super::chains(
        &set("profile = \"amk-kw\"\n[parameters]\nPrm87 = 1\nPrm88 = 500\nPrm90 = 750"),
        &around,
    );
    assert_eq!(total(&sampled, "function to SA1"), "3.15");
}

/// LNZ-EX-16 to LNZ-EX-20
#[test]
fn lenze_chains_follow_the_examples() {
    let first = Surroundings {
        sensor: 10_000,
        controller: 30_000,
        bus: 20_000,
        watchdog: 110_000,
        ..Surroundings::default()
    };
    let plain = chains(&set("profile = \"lenze-sm301\"\n[parameters]\n\"C15034/2\" = 100"), &first);
    assert_eq!(total(&plain, "SD-In1 through the controller to function"), "144");
    assert_eq!(total(&plain, "SD-In1 to function"), "14");
    assert_eq!(total(&plain, "SD-In2 to function"), "114");
    assert_eq!(total(&plain, "input error to function"), "16");
    assert_eq!(total(&plain, "PROFIsafe control word to function"), "64");
    assert_eq!(total(&plain, "SD-In1 to PROFIsafe data"), "34");
    assert_eq!(total(&plain, "SD-In1 to PROFIsafe data in the controller"), "54");
    let slow = Surroundings { controller: 40_000, bus: 50_000, ..first };
    let slow = chains(&set("profile = \"lenze-sm301\"\n[parameters]\n\"C15034/1\" = 100"), &slow);
    assert_eq!(total(&slow, "SD-In1 through the controller to function"), "288");
}

/// ATV-EX-10 to ATV-EX-12, ATV-EX-14, ATV-EX-15
#[test]
fn atv_chains_follow_the_examples() {
    let around = Surroundings {
        controller: 30_000,
        bus: 4_000,
        watchdog: 150_000,
        start_mhz: 50_000,
        ..Surroundings::default()
    };
    let base = "profile = \"atv340\"\n[parameters]\nSC34 = 5\nSC31 = 10.0\nSC32 = 5.0\nSC33 = 5.0\n";
    let closed = chains(&set(base), &around);
    assert_eq!(total(&closed, "lost telegram to STO"), "170");
    assert_eq!(total(&closed, "violation of SLS or SMS to STO"), "120");
    assert_eq!(total(&closed, "SS1 to STO"), "5025");
    assert_eq!(total(&closed, "smallest watchdog time"), "50");
    assert_eq!(ms(atv_watchdog_limit(50_000)), "65");
    let open = chains(&set(&format!("{base}SC05 = \"No encoder used\"")), &around);
    assert_eq!(total(&open, "violation of SLS or SMS to STO"), "670");
}

#[test]
fn an_undefined_ramp_promises_no_time() {
    let chains = chains(&set("profile = \"atv340\""), &Surroundings::default());
    assert!(!chains.iter().any(|chain| chain.name == "SS1 to STO"));
}

#[test]
fn a_chain_shows_its_addends() {
    let shown = amk_of(250, 250, Surroundings::default())[0].to_string();
    assert_eq!(shown, "SE1 to function: 1.25 ms = 0 sensor + 0.25 input + 1 filter (AMK-TIME-02)");
}
