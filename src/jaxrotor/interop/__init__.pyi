from .ross import from_ross as from_ross
