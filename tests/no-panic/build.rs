//! Links without start files and without open symbols: a shared library may leave symbols
//! open by default, this one may not. memcpy and its like come from the C library.

fn main() {
    for option in ["-nostartfiles", "-Wl,-z,defs", "-Wl,--gc-sections", "-lc", "-lgcc_eh", "-lgcc"] {
        println!("cargo:rustc-cdylib-link-arg={option}");
    }
}
