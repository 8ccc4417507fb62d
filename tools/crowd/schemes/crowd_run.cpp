// SPDX-License-Identifier: MIT
#include "crowd/schemes/crowd_run.h"

namespace terrane::tools {

void CrowdTotals::add(const CrowdQuery& query) {
    ++queries;
    query_ms += query.query_ms;
    boxes_ms += query.boxes_ms;
    update_ms += query.update_ms;
    boxes += query.boxes;
    pairs += query.pairs;
    touching += query.touching;
    candidates += query.candidates;
    if (query.touching == 0) return;
    ++positive_queries;
    positive_ms += query.query_ms;
}

void CrowdTotals::add(const CrowdTotals& other) {
    queries += other.queries;
    positive_queries += other.positive_queries;
    query_ms += other.query_ms;
    positive_ms += other.positive_ms;
    boxes_ms += other.boxes_ms;
    update_ms += other.update_ms;
    boxes += other.boxes;
    pairs += other.pairs;
    touching += other.touching;
    candidates += other.candidates;
}

CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on) {
    CrowdTotals totals;
    do {
        totals.add(crowd.query());
        crowd.move(dt);
    } while (goes_on(totals));
    return totals;
}

}  // namespace terrane::tools
