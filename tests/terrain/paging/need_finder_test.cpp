// SPDX-License-Identifier: MIT
//
// NeedFinder against a traversal that looks up every chunk by its key.
#include "paging/need_finder.h"

#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <vector>

namespace terrane::internal::need_finder_test {

using test::SeededRandom;

constexpr int kFinest = 5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDecay = 0.5;  // of a finder that has learned nothing

const test::WaveHeights& ground() {
    static const test::WaveHeights heights(test::small_world(kFinest, 1.0), 120.0, 150.0);
    return heights;
}

std::shared_ptr<const Chunk> chunk_of(const ChunkKey& key) {
    static std::map<ChunkKey, std::shared_ptr<const Chunk>> made;
    std::shared_ptr<const Chunk>& chunk = made[key];
    if (!chunk) chunk = make_chunk(ground(), key).value();
    return chunk;
}

struct Scene {
    std::vector<BodyNeed> bodies;
    std::vector<RegionNeed> regions;
    std::vector<PredictedView> views;
};

WorldPos draw_place(SeededRandom& random) {
    const double half = 0.5 * (ground().extent().east - ground().extent().west);
    return {random.between(-half, half), random.between(-half, half), random.between(-100, 300)};
}

Scene draw_scene(SeededRandom& random) {
    Scene scene;
    for (int i = random.below(30); i > 0; --i) {
        scene.bodies.push_back({.centre_world = draw_place(random),
                                .velocity = {random.between(-100, 100), random.between(-100, 100),
                                             random.between(-20, 0)},
                                .radius = random.between(0.1, 10)});
    }
    for (int i = random.below(3); i > 0; --i) {
        const WorldPos from = draw_place(random);
        scene.regions.push_back({{from.x(), from.y(), from.x() + random.between(0, 300),
                                  from.y() + random.between(0, 300)},
                                 random.between(-1, 4)});
    }
    for (int i = random.below(3); i > 0; --i) {
        const WorldPos eye = draw_place(random);
        WorldPos at = eye;
        PredictedView predicted;
        for (int state = 0; state < 3; ++state) {
            const View view = look_at(at, at + WorldPos(50, 20 * i, -10), 1.0, 1280, 720).value();
            predicted.states.push_back({.time_s = 1.5 * state,
                                        .eye_world = at,
                                        .frustum = make_frustum(view),
                                        .direction_margin = 0.1 * state});
            predicted.distance_per_bound = view.pixels_per_radian() / 2.0;
            predicted.near_distance = view.near_distance;
            at += WorldPos(random.between(-100, 100), random.between(-100, 100), 0);
        }
        predicted.update_eye_bounds();
        scene.views.push_back(predicted);
    }
    return scene;
}

// A random tree; some chunks above contact are outlines.
ChunkTree draw_tree(SeededRandom& random, int contact_level) {
    ChunkTree tree(ground().lattice(), chunks_of(ground()));
    std::vector<ChunkKey> open;
    for (const ChunkKey& root : tree.roots()) {
        if (random.below(8) > 0) open.push_back(root);
    }
    while (!open.empty()) {
        const ChunkKey key = open.back();
        open.pop_back();
        const auto chunk = chunk_of(key);
        const ChunkTree::Index index = tree.insert(chunk);
        const int below = contact_level - key.level;
        if (key.level > 0 && below > 0 && random.below(3) == 0) {
            tree.replace(index, std::make_shared<const ChunkOutline>(make_outline(
                                    *chunk, contact_level, ground().lattice().quantum)));
        }
        for (int quadrant = 0; quadrant < 4 && key.level < kFinest; ++quadrant) {
            if (random.below(8) < 3) open.push_back(key.child(quadrant));
        }
    }
    return tree;
}

// What NeedFinder should find, by key.
class Expected {
public:
    Expected(const ChunkTree& tree, const Scene& scene, const ContactNeeds& contact,
             int contact_level, double time_s, bool may_guess,
             std::map<ChunkKey, double>& contact_until)
        : tree_(tree),
          scene_(scene),
          contact_(contact),
          contact_level_(contact_level),
          time_s_(time_s),
          may_guess_(may_guess),
          contact_until_(contact_until) {
        for (const ChunkKey& root : tree.roots()) {
            const Need need{NeedClass::root, 0.0, kInfinity, 0.0};
            if (tree.find(root) == ChunkTree::kNone) {
                candidates.push_back({root, need, -load_s_});
            } else {
                needs[root] = visit(root, need).all;
            }
        }
        std::sort(candidates.begin(), candidates.end(), has_priority_over);
    }

    std::map<ChunkKey, Need> needs;         // of resident chunks
    std::map<ChunkKey, bool> to_be_drawn;   // likewise, but for roots
    std::vector<LoadCandidate> candidates;  // by priority

private:
    struct Needs {
        Need all, of_drawing;
        double slack_s = kInfinity;
    };

    Need camera_need(const WorldBox& box, double bound, double arrival_s, bool is_resident) const {
        Need need;
        for (const PredictedView& view : scene_.views) {
            need = combine(need, view.find_need(box, bound, arrival_s, is_resident));
        }
        return need;
    }

    Needs own_needs(const ChunkKey& key, const Need& of_camera) const {
        Needs own{of_camera, of_camera};
        const double time_s = key.level <= contact_level_ ? contact_.time_until(key) : kInfinity;
        if (time_s == kInfinity) return own;
        own.all = combine(own.all, {NeedClass::contact, time_s, contact_.end_of(key), 0.0});
        for (const RegionNeed& region : scene_.regions) {
            if (overlaps(ground().lattice(), key, region.region)) own.of_drawing = own.all;
        }
        return own;
    }

    Needs visit(const ChunkKey& key, const Need& need) {
        Needs needs_of{need, {}};
        if (key.level == kFinest) return needs_of;
        const ChunkTree::Quadrants& held = tree_.quadrants(tree_.find(key));
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            const auto at = static_cast<std::size_t>(quadrant);
            const ChunkKey child = key.child(quadrant);
            const ChunkTree::Index index = tree_.find(child);
            const WorldBox& box = held.boxes[at];
            const double bound = held.bounds[at];
            Needs own =
                own_needs(child, camera_need(box, bound, load_s_, index != ChunkTree::kNone));
            if (index == ChunkTree::kNone) {
                if (own.all.is_needed()) own = visit_absent(child, box, bound, load_s_, own);
            } else {
                own = visit_held(child, box, bound, own);
            }
            needs_of = {combine(needs_of.all, own.all),
                        combine(needs_of.of_drawing, own.of_drawing)};
        }
        return needs_of;
    }

    Needs visit_held(const ChunkKey& key, const WorldBox& box, double bound, Needs own) {
        Need kept = camera_need(box, 1.1 * bound, load_s_, true);
        bool is_kept = own.all.why == NeedClass::contact && kept.is_needed();
        if (own.all.why == NeedClass::contact) {
            contact_until_[key] = time_s_ + std::min(own.all.end_s, own.all.begin_s + 1.0);
        } else if (!own.all.is_needed()) {
            kept.ratio /= 1.1;
            if (contact_until_.contains(key) && contact_until_[key] > time_s_)
                kept = combine(kept, {NeedClass::contact, 0.0, 0.0, 0.0});
            if (kept.is_needed()) kept.why = NeedClass::speculation;
            own.all = kept;
            is_kept = kept.is_needed();
        }
        if (own.all.is_needed()) {
            const Needs below = visit(key, own.all);
            own = {below.all, combine(own.of_drawing, below.of_drawing)};
        }
        needs[key] = own.all;
        to_be_drawn[key] = own.of_drawing.is_needed() || is_kept;
        if (tree_[tree_.find(key)].outline != nullptr && own.of_drawing.is_needed()) {
            candidates.push_back({key, own.of_drawing, own.of_drawing.begin_s - load_s_});
        }
        return own;
    }

    Needs visit_absent(const ChunkKey& key, const WorldBox& box, double bound, double arrival_s,
                       Needs own) {
        const std::size_t at = candidates.size();
        candidates.push_back({key, own.all});
        own.slack_s = own.all.begin_s - load_s_;
        const double margin = ground().lattice().level_spacing(key.level + 1);
        for (int quadrant = 0; quadrant < 4 && key.level < kFinest; ++quadrant) {
            const ChunkKey child = key.child(quadrant);
            const double arrives_s = arrival_s + load_s_;
            const WorldRect rect = rect_of(ground().lattice(), child);
            const WorldBox child_box{{rect.west - margin, rect.south - margin, box.low.z()},
                                     {rect.east + margin, rect.north + margin, box.high.z()}};
            Need seen = camera_need(child_box, kDecay * bound, arrives_s, false);
            if (!may_guess_ || seen.why != NeedClass::drawn || seen.begin_s >= arrives_s) seen = {};
            Needs below = own_needs(child, seen);
            if (!below.all.is_needed()) continue;
            const NeedClass why = below.all.why;
            below = visit_absent(child, child_box, kDecay * bound, arrives_s, below);
            if (why <= own.all.why) own.slack_s = std::min(own.slack_s, below.slack_s - load_s_);
            own.of_drawing = combine(own.of_drawing, below.of_drawing);
        }
        candidates[at].slack_s = own.slack_s;
        candidates[at].is_to_be_drawn = own.of_drawing.is_needed();
        return own;
    }

    const double load_s_ = LoadTimes().expected_s(0);
    const ChunkTree& tree_;
    const Scene& scene_;
    const ContactNeeds& contact_;
    int contact_level_;
    double time_s_;
    bool may_guess_;
    std::map<ChunkKey, double>& contact_until_;
};

bool is_same(const Need& a, const Need& b) {
    return a.why == b.why && a.begin_s == b.begin_s && a.end_s == b.end_s && a.ratio == b.ratio;
}

TEST(NeedFinder, FindsWhatLookingUpEveryChunkFinds) {
    constexpr std::uint64_t kSeed = 31;
    SeededRandom random(kSeed);
    std::size_t of_bodies = 0, of_drawing = 0, upgraded = 0, resident = 0;
    for (int run = 0; run < test::few_or_many(150, 3000); ++run) {
        SCOPED_TRACE(testing::Message() << "run " << run);
        const int contact_level = kFinest - random.below(2);
        ChunkTree tree = draw_tree(random, contact_level);
        NeedFinder finder(PagerSettings{});
        ContactNeeds contact(ground(), contact_level);
        std::map<ChunkKey, double> contact_until;
        const LoadTimes times;
        for (int plan = 0; plan < 3; ++plan) {
            const Scene scene = random.below(8) == 0 ? Scene{} : draw_scene(random);
            const double time_s = 0.4 * plan;
            const bool may_guess = random.below(3) > 0;
            contact.find(scene.bodies, scene.regions, time_s, 2.0);
            finder.find(tree, scene.views, contact, times, time_s, may_guess);
            const Expected expected(tree, scene, contact, contact_level, time_s, may_guess,
                                    contact_until);
            std::vector<LoadCandidate> found = finder.candidates();
            std::sort(found.begin(), found.end(), has_priority_over);
            ASSERT_EQ(found.size(), expected.candidates.size());
            for (std::size_t i = 0; i < found.size(); ++i) {
                const LoadCandidate& wanted = expected.candidates[i];
                ASSERT_EQ(found[i].key, wanted.key);
                ASSERT_TRUE(is_same(found[i].need, wanted.need));
                ASSERT_EQ(found[i].slack_s, wanted.slack_s);
                ASSERT_EQ(found[i].is_to_be_drawn, wanted.is_to_be_drawn);
                (wanted.is_to_be_drawn ? of_drawing : of_bodies) += 1;
                upgraded += tree.find(wanted.key) != ChunkTree::kNone ? 1u : 0u;
            }
            std::size_t needed = 0;
            for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) {
                const auto wanted = expected.needs.find(tree[i].key);
                const Need none;
                ASSERT_TRUE(
                    is_same(tree[i].need, wanted == expected.needs.end() ? none : wanted->second));
                const auto drawn = expected.to_be_drawn.find(tree[i].key);
                if (tree[i].key.level > 0) {
                    ASSERT_EQ(tree[i].is_to_be_drawn,
                              drawn != expected.to_be_drawn.end() && drawn->second);
                }
                needed += wanted != expected.needs.end() ? 1u : 0u;
                ++resident;
            }
            ASSERT_EQ(finder.needed().size(), needed);
        }
    }
    EXPECT_GT(of_bodies, 3000u);
    EXPECT_GT(of_drawing, 10'000u);
    EXPECT_GT(upgraded, 300u);
    EXPECT_GT(resident, 5000u);
}

}  // namespace terrane::internal::need_finder_test
