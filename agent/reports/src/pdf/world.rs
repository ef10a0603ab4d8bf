//! What typst reads a report from: the template, the page and its pictures in memory, and the fonts that come with typst. Nothing
//! is read from disk or network.

use super::page::Page;
use crate::ReportError;
use serde_json::{Value, json};
use typst::diag::{FileError, FileResult};
use typst::foundations::{Bytes, Datetime, Duration};
use typst::syntax::{FileId, RootedPath, Source, VirtualPath, VirtualRoot};
use typst::text::{Font, FontBook};
use typst::utils::LazyHash;
use typst::{Library, LibraryExt, World};

const TEMPLATE: &str = include_str!("report.typ");

/// A report for typst.
pub(super) struct ReportWorld {
    library: LazyHash<Library>,
    book: LazyHash<FontBook>,
    fonts: Vec<Font>,
    template: Source,
    page: Bytes,
    pictures: Vec<Bytes>,
}

impl ReportWorld {
    /// The world of `page`; `title` and `author` are those of the document.
    ///
    /// # Errors
    /// [`ReportError::Pdf`] if the template has no name.
    pub(super) fn new(page: Page, title: &str, author: &str) -> Result<Self, ReportError> {
        let fonts: Vec<Font> = typst_assets::fonts().flat_map(|data| Font::iter(Bytes::new(data))).collect();
        let name = VirtualPath::new("report.typ").map_err(|error| ReportError::Pdf(error.to_string()))?;
        let template = FileId::new(RootedPath::new(VirtualRoot::Project, name));
        let data: Value = json!({ "title": title, "author": author, "body": page.body });
        Ok(Self {
            library: LazyHash::new(Library::default()),
            book: LazyHash::new(FontBook::from_fonts(&fonts)),
            fonts,
            template: Source::new(template, TEMPLATE.to_owned()),
            page: Bytes::from_string(data.to_string()),
            pictures: page.pictures.into_iter().map(Bytes::new).collect(),
        })
    }
}

impl World for ReportWorld {
    fn library(&self) -> &LazyHash<Library> {
        &self.library
    }

    fn book(&self) -> &LazyHash<FontBook> {
        &self.book
    }

    fn main(&self) -> FileId {
        self.template.id()
    }

    fn source(&self, id: FileId) -> FileResult<Source> {
        if id == self.template.id() { Ok(self.template.clone()) } else { Err(FileError::AccessDenied) }
    }

    fn file(&self, id: FileId) -> FileResult<Bytes> {
        let name = id.vpath().get_without_slash();
        if name == "page.json" {
            return Ok(self.page.clone());
        }
        let picture = name.strip_suffix(".svg").and_then(|number| number.parse::<usize>().ok());
        picture.and_then(|number| self.pictures.get(number)).cloned().ok_or(FileError::AccessDenied)
    }

    fn font(&self, index: usize) -> Option<Font> {
        self.fonts.get(index).cloned()
    }

    /// A report speaks of the past alone.
    fn today(&self, _offset: Option<Duration>) -> Option<Datetime> {
        None
    }
}
