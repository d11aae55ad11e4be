//! Commands of the program, a file each: arguments in, files and text out.

pub mod advise;
pub mod capture;
pub mod converge;
pub mod verify;
