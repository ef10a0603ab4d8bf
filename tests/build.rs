//! Tells the tests at compile time whether real captures are at hand: those that read them are ignored, and reported as
//! such, where they are not.

fn main() {
    println!("cargo:rerun-if-env-changed=SEMASCAN_DATA");
    println!("cargo:rustc-check-cfg=cfg(semascan_data)");
    if std::env::var_os("SEMASCAN_DATA").is_some() {
        println!("cargo:rustc-cfg=semascan_data");
    }
}
