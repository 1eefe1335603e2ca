from .finding import Assessment as Assessment, Finding as Finding
