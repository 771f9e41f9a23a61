//! MPS2 boards: Cortex-M4F, M7, M33.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use gestus_core::{Config, Database, Digest, Pose, Stylizer};
use gestus_firmware::{
    counter::{Counter, SysTick},
    flash, stack,
    stages::Stages,
};
use semihosting::{println, process::exit};

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    println!("{info}");
    exit(101)
}

#[inline(never)]
fn step(
    s: &mut Stylizer<'static, 22, 40, 28>,
    i: &Pose<22>,
    o: &mut Pose<22>,
    w: &mut Stages<SysTick<40_000>>,
) -> gestus_core::Report {
    s.step_observed(i, o, w)
}

#[entry]
fn main() -> ! {
    stack::paint();
    let timer = SysTick::<40_000>::start(cortex_m::Peripherals::take().unwrap().SYST);
    let a = timer.now();
    let database = match Database::open(flash::blob()) {
        Ok(d) => d,
        Err(e) => {
            println!("{e}");
            exit(1)
        }
    };
    println!("open {} {}", timer.since(a, timer.now()), stack::used());
    let mut s = Stylizer::<22, 40, 28>::new(database, Config::new()).unwrap();
    println!("new {}", stack::used());
    println!("{}", database.counts().frames);
    let mut w = Stages::new(timer);
    stack::paint();
    println!("depth {}", stack::depth());
    let _ = s.set_style(&[(1, 1.0)]);
    let clip: &'static [u8] = unsafe { core::slice::from_raw_parts(0x21f0_0000 as *const u8, 0xf0000) };
    let n = u32::from_le_bytes(clip[..4].try_into().unwrap()) as usize;
    let mut out = Pose::IDENTITY;
    let mut digest = Digest::new();
    for t in 0..n {
        let mut pose = Pose::<22>::IDENTITY;
        let at = |i: usize| f32::from_le_bytes(clip[4 + (t * 87 + i) * 4..][..4].try_into().unwrap());
        for i in 0..3 {
            pose.position[i] = at(i);
        }
        for j in 0..21 {
            for i in 0..4 {
                pose.rotations[j][i] = at(3 + 4 * j + i);
            }
        }
        w.begin();
        let r = step(&mut s, &pose, &mut out, &mut w);
        let n = w.end();
        digest.add(&out, database.counts().joints, r.step_s);
        println!("{} {} {} {} {} {:?}", t, n.total(), r.visits, r.bytes_read, r.classes.len(), n.stages);
    }
    println!("digest {:08x} stack {} ram {}", digest.value(), stack::used(), size_of_val(&s));
    exit(0)
}
