// Throng: finds every pair of overlapping boxes.
#pragma once

#include <throng/cpp17.hpp>

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>
#include <throng/checksum.hpp>
#include <throng/contact.hpp>
#include <throng/explain.hpp>
#include <throng/find_pairs.hpp>
#include <throng/finder.hpp>
#include <throng/large_pages.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>
#include <throng/update_boxes.hpp>
#include <throng/version.hpp>
