//! The page on what is supported says what the reader does.

use std::collections::BTreeSet;

use super::read;

/// Rows of the page: the kind of plugin (a heading), its type, and whether it renders.
fn rows() -> Vec<(String, String, bool)> {
    let page = include_str!("../../../../docs/scenes.md");
    let (mut rows, mut kind) = (Vec::new(), "");
    for line in page.lines() {
        if let Some(heading) = line.strip_prefix('#') {
            kind = heading.trim_start_matches('#').trim();
        }
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let plugin = cells.next().and_then(|c| c.strip_prefix('`')?.strip_suffix('`'));
        let (Some(plugin), Some(renders)) = (plugin, cells.next()) else { continue };
        let yes = renders.starts_with("yes");
        assert!(yes || renders.starts_with("no"), "{line}");
        rows.push((kind.to_owned(), plugin.to_owned(), yes));
    }
    rows
}

/// A scene with a plugin where it may stand.
fn with(kind: &str, plugin: &str) -> String {
    let element = format!("<{kind} type=\"{plugin}\"/>");
    match kind {
        "texture" => format!(
            "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"{plugin}\"/></bsdf>"
        ),
        "volume" => format!(
            "<medium type=\"heterogeneous\"><volume name=\"albedo\" type=\"{plugin}\"/></medium>"
        ),
        "film" => format!("<sensor type=\"perspective\">{element}</sensor>"),
        "rfilter" => with("film", "hdrfilm")
            .replace("\"hdrfilm\"/>", &format!("\"hdrfilm\">{element}</film>")),
        _ => element,
    }
}

fn message(kind: &str, plugin: &str) -> String {
    read(&with(kind, plugin)).map_or_else(|e| e.to_string(), |_| String::new())
}

#[test]
fn the_page_says_what_the_reader_does() {
    let rows = rows();
    assert!(rows.len() > 90, "{}", rows.len());
    for (kind, plugin, renders) in &rows {
        let message = message(kind, plugin);
        let refused = message.contains(&format!("type `{plugin}` is not supported"));
        assert_eq!(refused, !renders, "{kind} `{plugin}`: {message}");
    }
}

/// What the reader lists as expected is what the page says renders, no more and no less.
#[test]
fn nothing_is_missing_on_the_page() {
    let rows = rows();
    let kinds: BTreeSet<&str> = rows.iter().map(|(kind, ..)| kind.as_str()).collect();
    for kind in kinds.into_iter().filter(|k| *k != "integrator") {
        let message = message(kind, "nonsense");
        let (_, list) = message.rsplit_once("expected ").expect("a list of what there is");
        let read: BTreeSet<&str> = list.split(", ").flat_map(|w| w.split(" or ")).collect();
        let there = rows.iter().filter(|(k, _, renders)| k == kind && *renders);
        let page: BTreeSet<&str> = there.map(|(_, plugin, _)| plugin.as_str()).collect();
        assert_eq!(page, read, "{kind}");
    }
}
