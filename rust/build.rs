//! Finds or builds the C++ library. In this order:
//!
//! 1. `THRONG_DIR`: a folder into which Throng was installed.
//! 2. pkg-config, if it knows `throng`.
//! 3. The C++ sources around this crate, built by CMake without programs, tests and a GPU.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn main() {
    for name in ["THRONG_DIR", "PKG_CONFIG", "PKG_CONFIG_PATH"] {
        println!("cargo:rerun-if-env-changed={name}");
    }
    let crate_folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    if let Some(folder) = env::var_os("THRONG_DIR") {
        link_installed(Path::new(&folder)).unwrap_or_else(|why| {
            fail(&format!("THRONG_DIR is {}: {why}", Path::new(&folder).display()))
        });
    } else if let Some(flags) = pkg_config(&["--static", "--libs", &format!("throng >= {VERSION}")])
    {
        // The private libraries are those of a static library; a shared one has none.
        link_by_flags(&flags);
        let include = pkg_config(&["--variable=includedir", "throng"]).unwrap_or_default();
        tests_include(Path::new(include.trim()));
    } else {
        let sources = crate_folder.join("..");
        link_installed(&build(&sources)).unwrap_or_else(|why| fail(&why));
    }
}

fn fail(why: &str) -> ! {
    eprintln!(
        "error: the C++ library Throng was not found or built: {why}\n\
         Do one of these:\n\
         - Install Throng, and set THRONG_DIR to the folder that has include/ and lib/.\n\
         - Install Throng where pkg-config finds it (`pkg-config --libs throng`).\n\
         - Use this crate inside of Throng's sources, with CMake 3.25 and a C++20 compiler."
    );
    exit(1);
}

/// Tests compare the declarations of src/sys.rs with the header in this folder.
fn tests_include(folder: &Path) {
    println!("cargo:rustc-env=THRONG_INCLUDE={}", folder.display());
}

/// What `pkg-config` prints; none if it is missing or fails.
fn pkg_config(arguments: &[&str]) -> Option<String> {
    let program = env::var("PKG_CONFIG").unwrap_or_else(|_| "pkg-config".into());
    let output = Command::new(program).args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

fn link_by_flags(flags: &str) {
    for flag in flags.split_whitespace() {
        if let Some(folder) = flag.strip_prefix("-L") {
            println!("cargo:rustc-link-search=native={folder}");
        } else if let Some(library) = flag.strip_prefix("-l") {
            println!("cargo:rustc-link-lib={library}");
        } else if flag == "-pthread" {
            println!("cargo:rustc-link-lib=pthread");
        }
    }
}

/// Links the library that was installed into `prefix`. Its file `throng.pc` has the libraries that
/// a static library needs.
fn link_installed(prefix: &Path) -> Result<(), String> {
    let file = library_folders(prefix)
        .into_iter()
        .map(|folder| folder.join("pkgconfig/throng.pc"))
        .find(|file| file.is_file())
        .ok_or("it has no lib/pkgconfig/throng.pc; give the folder of an installation")?;
    println!("cargo:rerun-if-changed={}", file.display());
    let text = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let value = |key: &str| {
        text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or("").trim().to_owned()
    };
    let folder = file.parent().and_then(Path::parent).expect("it is lib/pkgconfig/throng.pc");
    println!("cargo:rustc-link-search=native={}", folder.display());
    println!("cargo:rustc-link-lib=throng");
    tests_include(&prefix.join("include"));
    // A new library is linked again.
    for library in ["libthrong.a", "libthrong.so", "libthrong.dylib", "throng.lib"] {
        let library = folder.join(library);
        if library.exists() {
            println!("cargo:rerun-if-changed={}", library.display());
        }
    }
    for name in value("Requires.private:").split_whitespace() {
        println!("cargo:rustc-link-lib={}", if name == "libhwy" { "hwy" } else { name });
    }
    link_by_flags(&value("Libs.private:"));
    Ok(())
}

/// `lib`, `lib64` and folders such as `lib/x86_64-linux-gnu`.
fn library_folders(prefix: &Path) -> Vec<PathBuf> {
    let lib = prefix.join("lib");
    let mut folders = vec![lib.clone(), prefix.join("lib64")];
    if let Ok(entries) = fs::read_dir(lib) {
        folders.extend(entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()));
    }
    folders
}

/// Builds the C++ sources and returns the folder into which they were installed.
fn build(sources: &Path) -> PathBuf {
    let file = sources.join("CMakeLists.txt");
    if !file.is_file() {
        fail(&format!("there is no {}", file.display()));
    }
    for name in ["CMakeLists.txt", "cmake", "include", "src"] {
        println!("cargo:rerun-if-changed={}", sources.join(name).display());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let (binaries, prefix) = (out.join("build"), out.join("installed"));
    let options = [
        "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_INSTALL_LIBDIR=lib",
        "-DTHRONG_BUILD_CLI=OFF",
        "-DTHRONG_BUILD_TESTS=OFF",
        "-DTHRONG_BUILD_BENCH=OFF",
        "-DTHRONG_CUDA=OFF",
        "-DTHRONG_MPI=OFF",
        // Needs no oneTBB.
        "-DTHRONG_THREADS=std",
    ];
    let install = format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display());
    run(Command::new("cmake")
        .arg("-S")
        .arg(sources)
        .arg("-B")
        .arg(&binaries)
        .args(options)
        .arg(install));
    // CMake's own warning is not shown: cargo hides what build scripts print.
    let cache = fs::read_to_string(binaries.join("CMakeCache.txt")).unwrap_or_default();
    if cache.contains("hwy_DIR:PATH=hwy_DIR-NOTFOUND") {
        println!(
            "cargo:warning=Highway was not found: Throng is built without SIMD, a search takes 5 to \
             14 times as long. Install it (Debian, Ubuntu: apt install libhwy-dev)."
        );
    }
    let jobs = env::var("NUM_JOBS").unwrap_or_else(|_| "1".into());
    run(Command::new("cmake").arg("--build").arg(&binaries).args([
        "--config",
        "Release",
        "--parallel",
        &jobs,
    ]));
    run(Command::new("cmake").arg("--install").arg(&binaries).args(["--config", "Release"]));
    prefix
}

fn run(command: &mut Command) {
    match command.status() {
        Ok(status) if status.success() => {}
        Ok(status) => fail(&format!("{command:?} failed: {status}")),
        Err(error) => fail(&format!("{:?} cannot be run: {error}", command.get_program())),
    }
}
