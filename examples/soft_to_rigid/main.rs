mod direct;
mod family;
mod law;
fn main() {}
