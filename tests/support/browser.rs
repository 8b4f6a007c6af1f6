//! Looks at pages as a browser lays them out: headless Chromium.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use serde::Deserialize;

/// A page that is not laid out by then hangs.
const PATIENCE: Duration = Duration::from_secs(180);

/// What a page looks like at one width.
#[derive(Debug, Deserialize)]
pub struct Layout {
    /// Width of the window, px.
    pub width: u32,
    /// Width that the page takes, px.
    pub taken: u32,
    /// Drawings.
    pub drawings: usize,
    /// Texts within drawings.
    pub labels: usize,
    /// Pairs of texts that lie on one another.
    pub overlaps: Vec<String>,
    /// Texts that reach out of their drawing or of the page.
    pub outside: Vec<String>,
    /// Blocks of the page that lie on one another.
    pub collisions: Vec<String>,
}

/// Lays a page out in a frame of a width and measures every text; what it finds is the document's only content.
const SCRIPT: &str = r#"
const frame = document.createElement('iframe');
frame.style = `width:${WIDTH}px;height:30000px;border:0`;
frame.onload = () => {
  const page = frame.contentDocument, found = { width: WIDTH, overlaps: [], outside: [], collisions: [] };
  found.taken = page.documentElement.scrollWidth;
  const words = node => node.textContent.trim().slice(0, 60);
  const apart = (a, b) => a.right <= b.left + 0.5 || b.right <= a.left + 0.5 || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
  const drawings = [...page.querySelectorAll('svg')];
  found.drawings = drawings.length;
  found.labels = 0;
  for (const drawing of drawings) {
    const whole = drawing.getBoundingClientRect();
    const texts = [...drawing.querySelectorAll('text')].map(node => [words(node), node.getBoundingClientRect()]);
    found.labels += texts.length;
    texts.forEach(([name, box], at) => {
      if (box.left < whole.left - 1 || box.right > whole.right + 1 || box.top < whole.top - 1 || box.bottom > whole.bottom + 1)
        found.outside.push(name);
      for (const [other, its] of texts.slice(at + 1)) if (!apart(box, its)) found.overlaps.push(`${name} | ${other}`);
    });
  }
  for (const node of page.querySelectorAll('h1,h2,h3,p,li,figcaption,table.facts td,table.list td')) {
    const box = node.getBoundingClientRect();
    if (box.right > WIDTH + 1 || box.left < -1 || node.scrollWidth > node.clientWidth + 1) found.outside.push(words(node));
  }
  const blocks = [...page.body.children, ...page.querySelectorAll('figure')];
  blocks.forEach((one, at) => blocks.slice(at + 1).forEach(other => {
    if (one.contains(other) || other.contains(one)) return;
    if (!apart(one.getBoundingClientRect(), other.getBoundingClientRect()))
      found.collisions.push(`${one.tagName} ${words(one)} | ${other.tagName} ${words(other)}`);
  }));
  document.body.textContent = 'FOUND' + JSON.stringify(found) + 'END';
};
frame.srcdoc = PAGE;
document.body.append(frame);
"#;

/// Chromium's program: that of `IMUCAL_CHROMIUM`, or the one on the path.
///
/// Without it the test is skipped, loudly; under `CI=true` it fails.
pub fn program() -> Option<PathBuf> {
    let named = std::env::var_os("IMUCAL_CHROMIUM").map(PathBuf::from);
    let on_path = || {
        let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
        let names = ["chromium", "chromium-browser", "google-chrome"];
        names
            .iter()
            .flat_map(|name| folders.iter().map(move |folder| folder.join(name)))
            .find(|path| path.exists())
    };
    let found = named.or_else(on_path);
    if found.is_none() {
        let missing = "no Chromium: install the package chromium, or set IMUCAL_CHROMIUM";
        assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{missing}");
        eprintln!("\n*** SKIPPED: {missing} ***\n");
    }
    found
}

/// Lays a page out in a window of a width, px.
///
/// # Panics
///
/// Where the browser fails, or says that something is wrong with the page.
pub fn layout(program: &Path, page: &str, width: u32) -> Layout {
    let folder = tempfile::tempdir().expect("a folder");
    let text = serde_json::to_string(page).expect("text").replace("</", "<\\/");
    let script = SCRIPT.replace("WIDTH", &width.to_string()).replace("PAGE", &text);
    let frame = folder.path().join("frame.html");
    fs::write(&frame, format!("<!DOCTYPE html><meta charset=utf-8><body><script>{script}</script>"))
        .expect("room");
    let output = assert_cmd::Command::new(program)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
        ])
        .arg("--window-size=1600,1200")
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", frame.display()))
        .timeout(PATIENCE)
        .output()
        .expect("the browser starts");
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let complaints: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    let found = dom.split_once("FOUND").and_then(|(_, rest)| rest.split_once("END"));
    let (found, _) = found.unwrap_or_else(|| panic!("the browser says nothing: {dom}\n{log}"));
    let found = found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&found).expect("the script's JSON")
}
