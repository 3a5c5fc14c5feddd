//! The entry points of the cores, and a panic handler that cannot be linked.
#![no_std]

#[cfg(any(feature = "channel-a", feature = "channel-b", feature = "crosscheck"))]
use shm_schema::exchange as x;

/// The control of the experiment: this panics, so building it must fail.
#[cfg(feature = "control")]
#[unsafe(no_mangle)]
fn index(octets: &[u8], at: usize) -> u8 {
    octets[at]
}

unsafe extern "C" {
    // Defined nowhere: the link fails as soon as any panic is reachable.
    fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: never linked; see above.
    unsafe { a_panic_is_reachable() }
}

// Named by precompiled parts of the core library, called by nobody.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

macro_rules! channel {
    ($feature:literal, $library:ident, $build:ident, $step:ident, $check:ident) => {
        #[cfg(feature = $feature)]
        #[unsafe(no_mangle)]
        fn $build(image: &[u8], setup: &x::Setup, out: &mut $library::Monitor) {
            *out = $library::Monitor::new(image, setup);
        }

        #[cfg(feature = $feature)]
        #[unsafe(no_mangle)]
        fn $step(monitor: &mut $library::Monitor, inputs: &x::Inputs, now_ns: u64, out: &mut x::Outputs) {
            *out = monitor.step(inputs, now_ns);
        }

        #[cfg(feature = $feature)]
        #[unsafe(no_mangle)]
        fn $check(
            guard: &mut $library::guard::Guard,
            octets: &[u8],
            crc: fn(&[u8]) -> u32,
            out: &mut x::Received<shm_schema::encoder::Encoder>,
        ) {
            *out = guard.check(octets, crc);
        }
    };
}
channel!("channel-a", channel_a, build_a, step_a, check_a);
channel!("channel-b", channel_b, build_b, step_b, check_b);

#[cfg(feature = "crosscheck")]
#[unsafe(no_mangle)]
fn step_crosscheck(
    crosscheck: &mut crosscheck::Crosscheck,
    inputs: &x::CrosscheckInputs,
    now_ns: u64,
    out: &mut x::CrosscheckOutputs,
) {
    *out = crosscheck.step(inputs, now_ns);
}

#[cfg(feature = "crosscheck")]
#[unsafe(no_mangle)]
fn limits_crosscheck(image: &[u8], setup: &x::Setup, out: &mut crosscheck::Crosscheck) {
    *out = crosscheck::Crosscheck::new(setup, &crosscheck::Limits::from_image(image));
}
