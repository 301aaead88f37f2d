//! An order in which assignments can be computed.

/// A topological order that keeps the order of the text where possible; or a cycle.
pub(super) fn sorted(needs: &[Vec<usize>]) -> Result<Vec<usize>, Vec<usize>> {
    #[derive(Clone, Copy, PartialEq)]
    enum Mark {
        New,
        Begun,
        Done,
    }
    let mut marks = vec![Mark::New; needs.len()];
    let mut order = Vec::with_capacity(needs.len());
    // Each node with the number of its dependencies that are visited. An explicit stack is used because a chain may be long.
    let mut path: Vec<(usize, usize)> = Vec::new();
    for first in 0..needs.len() {
        if marks[first] == Mark::New {
            marks[first] = Mark::Begun;
            path.push((first, 0));
        }
        while let Some((at, seen)) = path.last_mut() {
            let Some(&next) = needs[*at].get(*seen) else {
                marks[*at] = Mark::Done;
                order.push(*at);
                path.pop();
                continue;
            };
            *seen += 1;
            match marks[next] {
                Mark::Done => {}
                Mark::New => {
                    marks[next] = Mark::Begun;
                    path.push((next, 0));
                }
                Mark::Begun => {
                    let from = path.iter().position(|(i, _)| *i == next).unwrap_or(0);
                    return Err(path[from..].iter().map(|(i, _)| *i).collect());
                }
            }
        }
    }
    Ok(order)
}
