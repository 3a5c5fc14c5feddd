//! Messages of the shell, to standard error, never from the cycle.

/// Begins logging; `RUST_LOG` chooses what is shown.
pub fn begin() {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    // A second subscriber is refused; then there is one already.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
}
