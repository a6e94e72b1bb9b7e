use rig_host::plant::PlantConfig;
use rig_mcu::{board::Board, chip::Chip, emulation::Emulation, image::Image, unicorn::UnicornCpu};
use std::path::Path;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let seconds: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let image = Image::read(Path::new(&path)).unwrap();
    let cpu = UnicornCpu::new(Chip::new(Board::new(PlantConfig::default(), 1))).unwrap();
    let mut e = Emulation::new(cpu, image);
    let t = std::time::Instant::now();
    let r = e.run_for(seconds);
    if let Err(x) = &r {
        println!("{x}");
    }
    let w = e.with_chip(|c| c.work);
    println!(
        "{:?} t={} {:?} wall {:?}",
        w,
        e.seconds(),
        e.cost(34),
        t.elapsed()
    );
    let sent = e.with_chip(|c| c.take_sent());
    println!("sent {} stack {:?}", sent.len(), e.stack());
}
