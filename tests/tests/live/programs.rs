//! Where the programs are that the tests start.

use std::path::PathBuf;

/// `safepair` of the profile this test was built with: `target/<profile>/safepair`.
pub fn safepair() -> PathBuf {
    let own = std::env::current_exe().expect("this test has a file");
    let path = own.ancestors().nth(2).expect("target/<profile>/deps").join("safepair");
    assert!(path.is_file(), "{}: not built; build the programs first: cargo xtask test", path.display());
    path
}
