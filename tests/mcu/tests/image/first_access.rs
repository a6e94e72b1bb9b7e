//! The first access of the program to each cut of the chip's memories: a store there may be lost after a reset (errata
//! ES0430, 2.2.7).

use std::cell::RefCell;
use std::rc::Rc;

use rig_mcu::map;
use unicorn_engine::{Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, Unicorn};

use crate::image;

/// First addresses of the cuts: SRAM1 has three, SRAM2 and the CCM SRAM have one each.
const CUTS: [u32; 5] = [
    0x2000_0000,
    0x2000_8000,
    0x2001_0000,
    0x2001_4000,
    0x1000_0000,
];

/// The cut that an address lies in.
fn cut(address: u64) -> Option<usize> {
    let address = u32::try_from(address).ok()?;
    if map::CCM.contains(&address) {
        return Some(4);
    }
    map::RAM
        .contains(&address)
        .then(|| CUTS[..4].iter().rposition(|start| *start <= address))
        .flatten()
}

/// True for each cut whose first access is a load, until the program meets the first peripheral; `None` if it has none.
fn first_accesses() -> [Option<bool>; 5] {
    let flash = image().flash;
    let word = |at: usize| u32::from_le_bytes(flash[at..at + 4].try_into().unwrap());
    let (stack, start) = (word(0), word(4));
    let mut engine = Unicorn::new(Arch::ARM, Mode::MCLASS).unwrap();
    engine
        .ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)
        .unwrap();
    for (region, rights) in [
        (map::FLASH, Prot::READ | Prot::EXEC),
        (map::RAM, Prot::ALL),
        (map::CCM, Prot::ALL),
    ] {
        let size = u64::from(region.end - region.start);
        engine.mem_map(region.start.into(), size, rights).unwrap();
    }
    engine.mem_write(map::FLASH.start.into(), &flash).unwrap();
    let first = Rc::new(RefCell::new([None; 5]));
    let seen = Rc::clone(&first);
    engine
        .add_mem_hook(
            HookType::MEM_READ | HookType::MEM_WRITE,
            0,
            u64::MAX,
            move |_, kind, address, _, _| {
                if let Some(cut) = cut(address) {
                    seen.borrow_mut()[cut].get_or_insert(kind == MemType::READ);
                }
                true
            },
        )
        .unwrap();
    engine.reg_write(RegisterARM::SP, stack.into()).unwrap();
    // It ends with an error at the first peripheral, which is not there.
    let end = engine.emu_start(start.into(), 0x3000_0000, 0, 1_000_000);
    assert!(end.is_err(), "the program met no peripheral");
    *first.borrow()
}

#[test]
fn the_first_access_to_each_memory_is_a_load() {
    assert_eq!(first_accesses(), [Some(true); 5]);
}
