// The order of search results: pages that explain come before generated ones and before lists of pages.
// The page that explains a word of the glossary (EXPLAINED, by make_site.py) comes first, then a heading of that word.
// Sphinx embeds this file in searchtools.js.
var LATER = [
  [/^docs\/reference\/python\//, 12], [/^docs\/recipes$/, 8], [/^docs\/architecture$/, 8], [/^CHANGELOG$/, 12],
  [/^CONTRIBUTING$/, 10], [/^docs\/(index|tasks|concepts|reference|gallery)$/, 6], [/^index$/, 3], [/^docs\/robustness$/, 4],
  [/^docs\/errata$/, 4]
];
var singular = function (text) { return text.toLowerCase().trim().replace(/s$/, ""); };
var Scorer = {
  score: function (result) {
    var found = LATER.find(function (pair) { return pair[0].test(result[0]); });
    var query = (new URLSearchParams(window.location.search).get("q") || "").toLowerCase().trim();
    var explains = (EXPLAINED[query] || EXPLAINED[singular(query)]) === result[0];
    var exact = singular(result[1].split(" > ").pop()) === singular(query);
    return result[4] - (found ? found[1] : 0) + (exact ? 20 : 0) + (explains ? 40 : 0);
  },
  objNameMatch: 8, objPartialMatch: 4, objPrio: {0: 0, 1: 0, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2
};
