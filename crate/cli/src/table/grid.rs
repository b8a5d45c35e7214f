//! Rows and columns of words, as Markdown and as HTML.

/// A table.
pub struct Grid {
    /// A line above it.
    pub title: Option<String>,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Grid {
    /// Without a title. What a row lacks towards the head's length was not measured, and shows as a dash.
    pub fn new(head: &[&str], mut rows: Vec<Vec<String>>) -> Self {
        for row in &mut rows {
            row.resize(head.len(), "–".to_owned());
        }
        Self {
            title: None,
            head: head.iter().map(|cell| (*cell).to_owned()).collect(),
            rows,
        }
    }

    /// As Markdown, with a line break after it.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let title = self.title.as_ref().map(|title| format!("{title}:\n\n"));
        let rule = format!("|{}\n", "---|".repeat(self.head.len()));
        let body: String = self.rows.iter().map(|row| line(row)).collect();
        title.unwrap_or_default() + &line(&self.head) + &rule + &body
    }

    /// As a part of a page.
    pub fn html(&self) -> String {
        let line = |kind: &str, cells: &[String]| {
            let cell = |cell: &String| format!("<{kind}>{}</{kind}>", escaped(cell));
            let cells: String = cells.iter().map(cell).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let title = self.title.as_ref();
        let title = title.map(|title| format!("<caption>{}</caption>\n", escaped(title)));
        let body: String = self.rows.iter().map(|row| line("td", row)).collect();
        let title = title.unwrap_or_default();
        format!("<table>\n{title}{}{body}</table>\n", line("th", &self.head))
    }
}

/// Text as a page shows it.
pub fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;");
    text.replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
