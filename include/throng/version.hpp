#pragma once

#include <throng/cpp17.hpp>

#define THRONG_VERSION_MAJOR 0
#define THRONG_VERSION_MINOR 1
#define THRONG_VERSION_PATCH 0
#define THRONG_VERSION "0.1.0"
