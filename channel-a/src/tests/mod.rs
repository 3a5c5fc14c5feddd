//! The monitor as a whole, in virtual time, against the catalogues.

mod amk_functions;
mod amk_life;
mod atv;
pub mod bench;
mod bus;
mod drive;
mod encoder;
mod etg;
mod etg_parallel;
mod etg_refused;
mod lenze;
mod lenze_io;
mod lenze_special;
mod outputs;
mod robust;
mod startup;
mod timing;
