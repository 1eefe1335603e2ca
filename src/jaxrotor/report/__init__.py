"""What a run leaves behind for its reader."""

from .report import (
    summary as summary,
    summary_table as summary_table,
    write_report as write_report,
)
