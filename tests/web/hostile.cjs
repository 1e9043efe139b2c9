// Fifty names that would run, were they not text.
'use strict';
const TAGS = ['<script>hit=1</script>', '<img src=x onerror=hit=1>', '<svg onload=hit=1>', '"><b onmouseover=hit=1>', "'onfocus='hit=1' autofocus='",
    'javascript:hit=1', '<iframe srcdoc="<script>parent.hit=1</script>">', '{{constructor.constructor("hit=1")()}}', '<a href="javascript:hit=1">x</a>', '</title><script>hit=1</script>'];
const PAYLOADS = Array.from({ length: 50 }, (_, i) => `${i} ${TAGS[i % TAGS.length]}${i >= 10 ? `<!--${i}-->` : ''}`);

// Whether one of them ran, or became an element.
const ran = (page, within = 'main') => page.evaluate((root) => window.hit !== undefined
    || [...document.querySelectorAll(root)].some((node) => node.querySelector('img, iframe, script, b, a[href^=javascript], [onerror], [onload], [onmouseover], [onfocus]')), within);

module.exports = { PAYLOADS, ran };
