//! `cargo xtask demo | test | web | bench`.

fn main() {}
