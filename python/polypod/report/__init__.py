"""A mechanism, and its motion, as one page that needs nothing else: `write_report`, `report_html`."""

from polypod.report.page import report_html, write_report

__all__ = ["report_html", "write_report"]
