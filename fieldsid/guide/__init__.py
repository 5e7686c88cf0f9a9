"""The guide that is shipped with the program: its pages and JSON schemas lie beside this file."""

from fieldsid.guide.pages import Page, all_pages, pick_page

__all__ = ["Page", "all_pages", "pick_page"]
