"""Contact of the fabric with itself: pairs near one another, where they touch, and the impulses that part them."""
