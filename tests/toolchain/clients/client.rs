// An FMU of FMI 3.0 as programs in Rust load it: functions by their names from the dynamic linker.
// Arguments: library, token, step (s), number of steps, value references. Prints what two instances in two threads give.

use std::env;
use std::ffi::{c_char, c_int, c_void, CStr, CString};
use std::mem::transmute_copy;
use std::ptr::{null, null_mut};
use std::thread;

#[link(name = "dl")]
extern "C" {
    fn dlopen(file: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

type Instance = *mut c_void;
type Text = *const c_char;
type Logger = extern "C" fn(*mut c_void, c_int, Text, Text);
type Instantiate = unsafe extern "C" fn(
    Text, Text, Text, bool, bool, bool, bool, *const u32, usize, *mut c_void, Logger, *const c_void,
) -> Instance;
type Initialize = unsafe extern "C" fn(Instance, bool, f64, f64, bool, f64) -> c_int;
type Call = unsafe extern "C" fn(Instance) -> c_int;
type DoStep = unsafe extern "C" fn(
    Instance, f64, f64, bool, *mut bool, *mut bool, *mut bool, *mut f64,
) -> c_int;
type GetFloat64 = unsafe extern "C" fn(Instance, *const u32, usize, *mut f64, usize) -> c_int;
type Free = unsafe extern "C" fn(Instance);

extern "C" fn hear(_: *mut c_void, _: c_int, _: Text, message: Text) {
    eprintln!("{}", unsafe { CStr::from_ptr(message) }.to_string_lossy());
}

#[derive(Clone, Copy)]
struct Library(*mut c_void);
unsafe impl Send for Library {}

impl Library {
    unsafe fn function<T>(&self, name: &str) -> T {
        let name = CString::new(format!("fmi3{name}")).unwrap();
        let found = dlsym(self.0, name.as_ptr());
        assert!(!found.is_null(), "there is no {name:?}");
        transmute_copy(&found)
    }
}

unsafe fn run(library: Library, token: &str, step: f64, steps: usize, references: &[u32]) -> Vec<String> {
    let (name, token, none) = (CString::new("client").unwrap(), CString::new(token).unwrap(), null_mut());
    let instantiate: Instantiate = library.function("InstantiateCoSimulation");
    let c = instantiate(name.as_ptr(), token.as_ptr(), null(), false, false, false, false, null(), 0, none, hear, null());
    assert!(!c.is_null(), "no instance");
    let enter: Initialize = library.function("EnterInitializationMode");
    let exit: Call = library.function("ExitInitializationMode");
    let do_step: DoStep = library.function("DoStep");
    let get: GetFloat64 = library.function("GetFloat64");
    assert_eq!(enter(c, false, 0.0, 0.0, false, 0.0), 0);
    assert_eq!(exit(c), 0);
    let mut rows = Vec::new();
    for i in 0..steps {
        let (mut event, mut end, mut early, mut last) = (false, false, false, 0.0);
        let time = i as f64 * step;
        assert_eq!(do_step(c, time, step, true, &mut event, &mut end, &mut early, &mut last), 0);
        let mut values = vec![0.0; references.len()];
        assert_eq!(get(c, references.as_ptr(), values.len(), values.as_mut_ptr(), values.len()), 0);
        rows.push(values.iter().map(|v| format!("{:016x}", v.to_bits())).collect::<Vec<_>>().join(" "));
    }
    let terminate: Call = library.function("Terminate");
    assert_eq!(terminate(c), 0);
    let free: Free = library.function("FreeInstance");
    free(c);
    rows
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let file = CString::new(arguments[0].as_str()).unwrap();
    let library = Library(unsafe { dlopen(file.as_ptr(), 2) });
    let (step, steps): (f64, usize) = (arguments[2].parse().unwrap(), arguments[3].parse().unwrap());
    let references: Vec<u32> = arguments[4..].iter().map(|word| word.parse().unwrap()).collect();
    let threads: Vec<_> = (0..2)
        .map(|_| {
            let (token, references) = (arguments[1].clone(), references.clone());
            thread::spawn(move || unsafe {
                let library = library;
                run(library, &token, step, steps, &references)
            })
        })
        .collect();
    for running in threads {
        for row in running.join().unwrap() {
            println!("{row}");
        }
    }
}
